-- Messages of the IMAX, SMC and MBOX motion controllers for Wireshark and tshark, both directions.
--
-- Sources: SMC manual 2.2 and 2.3, IMAX manual 2.2 and 2.3. Where a message is refused, it is refused at the same byte
-- as by `kinocue decode`. Runs with Lua 5.1 to 5.4, so without bit operators.

local HOST_PORT, CONTROLLER_PORT = 8410, 7408
local CONFIRM_CONTROLLER, CONFIRM_SERVO = 0x55aa, 0x33cc
local HEADER_LEN = 12
local MAX_AXES, MAX_WORDS = 12, 256
local BODY = 20 -- where the positions of a motion message begin
local WORDS = 16 -- where the words of registers begin
local STEPS_PER_SECOND = 8000 -- of a vibration's period: 0.125 ms each
local NOTED_WORDS = 8 -- the most that the info column names
local EVERY_STATION = 0xffff

local RUNNING = 2

-- What a message is, by the high byte of its function code.
local FAMILIES = {
  [0x10] = { kind = "report", report = "report of registers" },
  [0x11] = { kind = "read", request = "read registers" },
  [0x12] = { kind = "write", request = "write registers" },
  [0x13] = { kind = "motion", request = "motion, absolute time", absolute = true },
  [0x14] = { kind = "motion", request = "motion, relative time" },
  [0x18] = { kind = "motion", request = "motion with vibration, absolute time", absolute = true, vibrating = true },
  [0x19] = { kind = "motion", request = "motion with vibration, relative time", vibrating = true },
  [0x21] = { kind = "read", request = "read servo registers", servo = true },
  [0x22] = { kind = "write", request = "write servo registers", servo = true },
  [0x31] = { kind = "status", report = "status report", servo = true },
}

local FUNCTIONS = {}
for family, is in pairs(FAMILIES) do
  FUNCTIONS[family * 256 + 1] = is.request or is.report
  if is.request then
    for code = 2, 5 do
      FUNCTIONS[family * 256 + code] = "reply to " .. is.request
    end
  end
end

local ANSWERS = {
  smc = {
    [2] = "received, running normally",
    [3] = "running with an error",
    [4] = "emergency stop in effect",
    [5] = "command error, or the controller is abnormal",
  },
  mbox = {
    [2] = "received, running normally",
    [3] = "refused: buffer full or wrong",
    [4] = "refused: the frame was too short",
    [5] = "command error, or the controller is abnormal",
  },
}

local ERRORS = {
  [0] = "unspecified",
  [7] = "the servo is of another model",
  [17] = "the play time is too long at the start",
  [20] = "UDP memory overflow",
  [21] = "UDP data buffer overflow; needs a reset",
}
for axis = 1, 6 do
  ERRORS[axis] = string.format("no communication with the servo of axis %d", axis)
  ERRORS[axis + 9] = string.format("alarm of the servo of axis %d", axis)
end

-- The monitor registers at which the positions of axes 1 to 6 begin, two words each.
local DP_POSITIONS = { [0x06] = 1, [0x08] = 2, [0x0a] = 3, [0x21] = 4, [0x23] = 5, [0x25] = 6 }

local kinocue = Proto("kinocue", "Motion Controller IMAX/SMC/MBOX")

kinocue.prefs.dialect = Pref.enum(
  "Dialect",
  1,
  "Decides where errors stand, the word order of positions, and what channel 0 of a register write means",
  { { 1, "SMC", 1 }, { 2, "MBOX", 2 } },
  false
)

-- Nobody is known to have seen a frame with vibration; the SMC manual prints four bytes (2.2.2.9).
kinocue.prefs.vibration_port_octets = Pref.enum(
  "Bytes of Port Out with vibration",
  2,
  "Of the outputs in frames with vibration, and of the inputs in the answers",
  { { 1, "2", 2 }, { 2, "4", 4 } },
  false
)

local f = {
  confirm = ProtoField.uint16("kinocue.confirm", "Confirm code", base.HEX),
  pass = ProtoField.uint16("kinocue.pass", "Pass code", base.HEX),
  code = ProtoField.uint16("kinocue.function", "Function", base.HEX, FUNCTIONS),
  answer = ProtoField.uint8("kinocue.answer", "Answer", base.DEC),
  channel = ProtoField.uint16("kinocue.channel", "Object channel", base.DEC),
  servo = ProtoField.uint16("kinocue.servo", "Servo", base.DEC),
  err = ProtoField.uint16("kinocue.error", "Error", base.DEC, ERRORS),
  accept = ProtoField.uint16("kinocue.accept", "Who accepts", base.HEX),
  reply = ProtoField.uint16("kinocue.reply", "Who replies", base.HEX),
  frame = ProtoField.uint32("kinocue.frame", "Frame number", base.DEC),
  time = ProtoField.uint32("kinocue.time", "Time (ms)", base.DEC),
  axis = ProtoField.int32("kinocue.axis", "Position (pulses)", base.DEC),
  output = ProtoField.uint16("kinocue.output", "Outputs", base.HEX),
  input = ProtoField.uint16("kinocue.input", "Inputs", base.HEX),
  extend = ProtoField.uint32("kinocue.extend", "Extend", base.HEX),
  dac1 = ProtoField.uint16("kinocue.extend.dac1", "Analogue output 1", base.DEC),
  dac2 = ProtoField.uint16("kinocue.extend.dac2", "Analogue output 2", base.DEC),
  period = ProtoField.uint16("kinocue.vibration.period", "Period (0.125 ms)", base.DEC),
  amplitude = ProtoField.uint16("kinocue.vibration.amplitude", "Amplitude (pulses)", base.DEC),
  hz = ProtoField.double("kinocue.vibration.hz", "Frequency (Hz)"),
  register = ProtoField.uint16("kinocue.register", "First register", base.HEX),
  count = ProtoField.uint16("kinocue.count", "Registers", base.DEC),
  value = ProtoField.uint16("kinocue.value", "Value", base.DEC),
  name = ProtoField.string("kinocue.register.name", "Register"),
  monitored = ProtoField.int32("kinocue.monitored", "Monitored position (pulses)", base.DEC),
  station = ProtoField.uint16("kinocue.station", "Station", base.HEX),
  axes = ProtoField.uint16("kinocue.axes", "Axes", base.DEC),
  force = ProtoField.int16("kinocue.force", "Force", base.DEC),
  servo_error = ProtoField.uint16("kinocue.servo.error", "Servo error", base.DEC),
  surplus = ProtoField.bytes("kinocue.surplus", "Bytes after the layout"),
  answers = ProtoField.framenum("kinocue.answers", "Answers", base.NONE, frametype.REQUEST),
  latency = ProtoField.double("kinocue.latency", "Ack latency (ms)"),
  bad_byte = ProtoField.uint32("kinocue.malformed.byte", "Malformed at byte", base.DEC),
  bad_why = ProtoField.string("kinocue.malformed.why", "Malformed because"),
}

-- There are twelve of each; the bits past them mean nothing and show in the word alone.
local bits = { output = {}, input = {} }
for bit = 1, 12 do
  local mask = 2 ^ (bit - 1)
  for word, letter in pairs({ output = "y", input = "x" }) do
    local name = string.format("%s%02d", letter, bit)
    local abbreviation = string.format("kinocue.%s.%s", word, name)
    bits[word][bit] = ProtoField.bool(abbreviation, name:upper(), 16, { "on", "off" }, mask)
  end
end

local fields = {}
for _, field in pairs(f) do
  table.insert(fields, field)
end
for _, word in pairs(bits) do
  for _, field in ipairs(word) do
    table.insert(fields, field)
  end
end
kinocue.fields = fields

local e = {
  malformed = ProtoExpert.new(
    "kinocue.malformed",
    "No message of the protocol",
    expert.group.MALFORMED,
    expert.severity.ERROR
  ),
  cut = ProtoExpert.new("kinocue.cut", "Cut short by the capture", expert.group.UNDECODED, expert.severity.WARN),
  refused = ProtoExpert.new(
    "kinocue.refused",
    "The controller refuses or stands still",
    expert.group.RESPONSE_CODE,
    expert.severity.WARN
  ),
  fault = ProtoExpert.new(
    "kinocue.fault",
    "A controller or servo reports an error",
    expert.group.RESPONSE_CODE,
    expert.severity.WARN
  ),
  surplus = ProtoExpert.new(
    "kinocue.surplus.expert",
    "Bytes after the layout, which controllers let pass",
    expert.group.PROTOCOL,
    expert.severity.NOTE
  ),
}
kinocue.experts = { e.malformed, e.cut, e.refused, e.fault, e.surplus }

local function dialect()
  return kinocue.prefs.dialect == 2 and "mbox" or "smc"
end

-- Reading --------------------------------------------------------------------------------------------------------

local function u16(tvb, at)
  return tvb(at, 2):uint()
end

local function fault(byte, why, ...)
  return nil, { byte = byte, why = string.format(why, ...) }
end

local function no_axes(byte, found)
  return fault(byte, "%d does not fit 3 to 12 axes", found)
end

local function ends(len, need)
  return fault(len, "ends after %d bytes; this message takes %d", len, need)
end

local function goes_on(len, need)
  return fault(need, "continues to %d bytes; this message takes %d", len, need)
end

local function port_len(vibrating)
  return vibrating and kinocue.prefs.vibration_port_octets or 2
end

local function motion_len(axes, vibrating)
  return BODY + 4 * axes + port_len(vibrating) + (vibrating and 4 * axes or 4)
end

local function axes_that_fit(len, vibrating)
  local per_axis = vibrating and 8 or 4
  local axes = math.floor((len - motion_len(0, vibrating)) / per_axis)
  return math.max(0, math.min(axes, MAX_AXES))
end

-- Channel 2 is taken from the length, 3 to 12 at their word.
local function axes_of_request(channel, len, vibrating)
  if channel == 0 then
    return 3
  elseif channel == 1 then
    return 6
  elseif channel == 2 then
    return axes_that_fit(len, vibrating)
  elseif channel <= MAX_AXES then
    return channel
  end
  return nil
end

local function read_motion(tvb, message)
  local len, vibrating = tvb:len(), message.is.vibrating
  local channel = u16(tvb, 6)
  if message.low == 1 then
    message.axes = axes_of_request(channel, len, vibrating)
  else
    message.axes = axes_that_fit(len, vibrating)
  end
  if not message.axes then
    return no_axes(6, channel)
  end
  local need = motion_len(math.max(message.axes, 1), vibrating)
  if len < need then
    return ends(len, need)
  end
  message.len = need
  return message
end

local function read_registers(tvb, message)
  local len = tvb:len()
  if len < WORDS then
    return ends(len, WORDS)
  end
  local count = u16(tvb, 14)
  message.len = WORDS
  message.words = 0
  if message.low == 1 and message.is.kind == "read" then
    return message
  end
  if message.low > RUNNING then -- may hold fewer words, or none
    message.words = math.min(math.floor((len - WORDS) / 2), count, MAX_WORDS)
  elseif count > MAX_WORDS then
    return fault(14, "%d registers at once; at most %d are possible", count, MAX_WORDS)
  else
    message.words = count
  end
  message.len = WORDS + 2 * message.words
  if len < message.len then
    return ends(len, message.len)
  end
  -- Nothing follows the words of a reply, or registers of 32 bits would be read as others. A refusal may bring an error.
  local most = WORDS + 2 * (message.low > RUNNING and math.max(count, 1) or count)
  if message.low ~= 1 and not message.is.servo and len > most then
    return goes_on(len, most)
  end
  return message
end

local function read_status(tvb, message)
  local len, axes = tvb:len(), u16(tvb, 8)
  if axes == 0 or axes > MAX_AXES then
    return no_axes(8, axes)
  end
  message.axes = axes
  message.len = 16 + 8 * axes
  if len < message.len then
    return ends(len, message.len)
  elseif len > message.len then
    return goes_on(len, message.len)
  end
  return message
end

-- The message in a datagram; or nil, and at which byte and why there is none.
local function read(tvb)
  local len = tvb:len()
  local short = "ends after %d bytes, inside the header; %d are needed"
  if len < 6 then
    return fault(len, short, len, HEADER_LEN)
  end
  local confirm, pass, code = u16(tvb, 0), u16(tvb, 2), u16(tvb, 4)
  local wrong = "confirm code %04x where %04x belongs"
  if confirm ~= CONFIRM_CONTROLLER and confirm ~= CONFIRM_SERVO then
    return fault(0, wrong, confirm, CONFIRM_CONTROLLER)
  elseif pass ~= 0 then
    return fault(2, "pass code %04x where 0000 belongs", pass)
  end
  local is = FAMILIES[math.floor(code / 256)]
  local expected = is and is.servo and CONFIRM_SERVO or CONFIRM_CONTROLLER
  if confirm ~= expected then
    return fault(0, wrong, confirm, expected)
  elseif not is then
    return fault(4, "function code %04x does not belong here", code)
  end
  local header_len = is.kind == "status" and 10 or HEADER_LEN
  if len < header_len then
    return fault(len, short, len, header_len)
  elseif not FUNCTIONS[code] then
    return fault(4, "function code %04x does not belong here", code)
  end
  local message = { is = is, code = code, low = code % 256 }
  if is.kind == "motion" then
    return read_motion(tvb, message)
  elseif is.kind == "status" then
    return read_status(tvb, message)
  end
  return read_registers(tvb, message)
end

-- Replies and what they answer --------------------------------------------------------------------------------

local asked -- the packet and the time of the latest request, by who asked and what
local answered -- the request's packet and the milliseconds since, by the packet of the reply

function kinocue.init()
  asked, answered = {}, {}
end

-- Told by the host's end alone, since a request may be for every station: a frame by its number, registers by place.
local function key_of(tvb, message, address, port)
  local family = math.floor(message.code / 256)
  return string.format("%s:%d %02x %08x", tostring(address), port, family, tvb(12, 4):uint())
end

-- Packets are seen in order the first time, and in any order after that.
local function match_reply(tvb, pinfo, message)
  if pinfo.visited or not message.is.request then
    return
  elseif message.low == 1 then
    asked[key_of(tvb, message, pinfo.src, pinfo.src_port)] = { packet = pinfo.number, at = pinfo.rel_ts }
    return
  end
  local request = asked[key_of(tvb, message, pinfo.dst, pinfo.dst_port)]
  if request then
    answered[pinfo.number] = { packet = request.packet, ms = (pinfo.rel_ts - request.at) * 1000 }
  end
end

local function add_answered(tree, pinfo)
  local request = answered[pinfo.number]
  if request then
    tree:add(f.answers, request.packet):set_generated()
    tree:add(f.latency, request.ms):set_generated()
  end
end

-- Showing --------------------------------------------------------------------------------------------------------

local function add_bits(tree, word, range, note)
  local item = tree:add(f[word], range)
  local value, on = range:uint(), {}
  for bit, field in ipairs(bits[word]) do
    item:add(field, range)
    if math.floor(value / 2 ^ (bit - 1)) % 2 == 1 then
      table.insert(on, string.format("%s%02d", word == "output" and "Y" or "X", bit))
    end
  end
  if #on > 0 then
    item:append_text(" " .. table.concat(on, " "))
    table.insert(note, word .. "s " .. table.concat(on, " "))
  end
end

local function add_error(tree, range, note)
  local item, number = tree:add(f.err, range), range:uint()
  if number ~= 0 then
    local words = ERRORS[number] or "not in the manual"
    table.insert(note, string.format("Err%d: %s", number, words))
    item:add_proto_expert_info(e.fault, string.format("Err%d: %s", number, words))
  end
end

local function add_positions(tree, tvb, at, axes, note)
  local positions = {}
  for axis = 1, axes do
    local range = tvb(at + 4 * (axis - 1), 4)
    tree:add(f.axis, range):set_text(string.format("a%d: %d pulses", axis, range:int()))
    table.insert(positions, string.format("%d", range:int()))
  end
  table.insert(note, "positions " .. table.concat(positions, " "))
end

local function add_vibration(tree, range, axis, note)
  local period, amplitude = range(0, 2):uint(), range(2, 2):uint()
  local item = tree:add(kinocue, range)
  item:add(f.period, range(0, 2))
  item:add(f.amplitude, range(2, 2))
  if period == 0 or amplitude == 0 then
    item:set_text(string.format("v%d: none", axis))
    return
  end
  local words = string.format("%.2f Hz %d pulses", STEPS_PER_SECOND / period, amplitude)
  item:add(f.hz, range(0, 2), STEPS_PER_SECOND / period):set_generated()
  item:set_text(string.format("v%d: %s", axis, words))
  table.insert(note, string.format("v%d %s", axis, words))
end

local function add_motion(tree, tvb, message, note)
  local axes = message.axes
  local time = tvb(16, 4):uint()
  tree:add(f.frame, tvb(12, 4))
  tree:add(f.time, tvb(16, 4))
  table.insert(note, string.format("frame %d", tvb(12, 4):uint()))
  table.insert(note, string.format(message.is.absolute and "at %d ms" or "in %d ms", time))
  add_positions(tree, tvb, BODY, axes, note)
  local tail = BODY + 4 * axes + port_len(message.is.vibrating)
  add_bits(tree, message.low == 1 and "output" or "input", tvb(tail - 2, 2), note)
  if not message.is.vibrating then
    local extend = tree:add(f.extend, tvb(tail, 4))
    extend:add(f.dac1, tvb(tail, 2))
    extend:add(f.dac2, tvb(tail + 2, 2))
    return
  end
  for axis = 1, axes do
    add_vibration(tree, tvb(tail + 4 * (axis - 1), 4), axis, note)
  end
end

-- The letters and the first digit of a register's name; nil where the table is unknown.
local function space_of(message, channel)
  if message.is.servo or message.low > RUNNING then
    return nil
  elseif message.is.kind ~= "write" then
    return ({ [0] = "DP", [1] = "PA" })[channel]
  elseif channel == 0 then
    return dialect() == "mbox" and "PA" or "DP"
  end
  return ({ [1] = "PA", [2] = "DPF" })[channel]
end

local function register_name(space, number)
  if not space then
    return string.format("%d", number)
  end
  return string.format(space == "DPF" and "%s%X" or "%s%02X", space, number)
end

-- Positions, where the words are those of position registers from a first one on.
local function add_monitored(tree, tvb, start, words, note)
  local first = DP_POSITIONS[start]
  if not first then
    return
  end
  local last = first <= 3 and 3 or 6
  for index = 0, math.min(math.floor(words / 2), last - first + 1) - 1 do
    local range = tvb(WORDS + 4 * index, 4)
    local one, other = range(0, 2):uint(), range(2, 2):uint()
    local high, low = other, one
    if dialect() == "mbox" then
      high, low = one, other
    end
    local position = high * 65536 + low
    if position >= 2 ^ 31 then
      position = position - 2 ^ 32
    end
    local words_for = string.format("a%d at %d", first + index, position)
    tree:add(f.monitored, range, position):set_text(words_for .. " pulses"):set_generated()
    table.insert(note, words_for)
  end
end

-- The first word of a refusal that is not 0, in which an MBOX tells its error in place of registers; else the last.
local function refusal_of(tvb, message)
  for index = 0, message.words - 2 do
    local range = tvb(WORDS + 2 * index, 2)
    if range:uint() ~= 0 then
      return range
    end
  end
  return tvb(WORDS + 2 * (message.words - 1), 2)
end

local function add_registers(tree, tvb, message, note)
  local start, count = u16(tvb, 12), u16(tvb, 14)
  local space = space_of(message, u16(tvb, 6))
  local refused = dialect() == "mbox" and not message.is.servo and message.low > RUNNING
  tree:add(f.register, tvb(12, 2)):append_text(" (" .. register_name(space, start) .. ")")
  tree:add(f.count, tvb(14, 2))
  if message.words == 0 or refused then
    local first = register_name(space, start)
    table.insert(note, count == 1 and first or string.format("%d registers from %s", count, first))
    for index = 0, math.min(count, MAX_WORDS) - 1 do
      tree:add(f.name, tvb(12, 4), register_name(space, start + index)):set_generated()
    end
  end
  if refused and message.words > 0 then
    return add_error(tree, refusal_of(tvb, message), note)
  end
  for index = 0, message.words - 1 do
    local range, name = tvb(WORDS + 2 * index, 2), register_name(space, start + index)
    local item = tree:add(f.value, range)
    item:set_text(string.format("%s: %d (0x%04x)", name, range:uint(), range:uint()))
    item:add(f.name, range, name):set_generated()
    if index < NOTED_WORDS then
      table.insert(note, string.format("%s = %d", name, range:uint()))
    elseif index == NOTED_WORDS then
      table.insert(note, string.format("... %d in all", message.words))
    end
  end
  if space == "DP" and message.low == RUNNING and message.is.kind == "read" then
    add_monitored(tree, tvb, start, message.words, note)
  end
end

local function add_status(tree, tvb, message, note)
  local axes = message.axes
  tree:add(f.station, tvb(6, 2))
  tree:add(f.axes, tvb(8, 2))
  table.insert(note, string.format("station %04x", u16(tvb, 6)))
  add_positions(tree, tvb, 10, axes, note)
  local forces, errors, rest = 10 + 4 * axes, 10 + 6 * axes, 10 + 8 * axes
  for axis = 1, axes do
    local range = tvb(forces + 2 * (axis - 1), 2)
    tree:add(f.force, range):set_text(string.format("a%d force: %d", axis, range:int()))
  end
  for axis = 1, axes do
    local range = tvb(errors + 2 * (axis - 1), 2)
    local words = string.format("a%d servo error %d", axis, range:uint())
    local item = tree:add(f.servo_error, range):set_text(words)
    if range:uint() ~= 0 then
      item:add_proto_expert_info(e.fault, words)
      table.insert(note, words)
    end
  end
  add_error(tree, tvb(rest, 2), note)
  add_bits(tree, "output", tvb(rest + 2, 2), note)
  add_bits(tree, "input", tvb(rest + 4, 2), note)
end

-- Slot 6 of a message with a header: object channel, servo or error number.
local function add_slot(tree, tvb, message, note)
  local range = tvb(6, 2)
  local servo_or_channel = message.is.servo and f.servo or f.channel
  if message.low <= RUNNING then
    tree:add(servo_or_channel, range)
    if message.is.servo then
      table.insert(note, string.format("servo %d", range:uint()))
    end
  elseif dialect() == "mbox" and not message.is.servo then
    tree:add(f.channel, range)
  else
    add_error(tree, range, note)
  end
end

local function add_header(tree, tvb, message, note)
  if message.low >= RUNNING then
    local words = ANSWERS[dialect()][message.low]
    local item = tree:add(f.answer, tvb(5, 1)):append_text(" (" .. words .. ")")
    table.insert(note, words)
    if message.low > RUNNING then
      item:add_proto_expert_info(e.refused, words)
    end
  end
  local accept = u16(tvb, 8)
  if message.is.request and message.low == 1 and accept ~= EVERY_STATION then
    table.insert(note, string.format("for %04x", accept))
  end
  add_slot(tree, tvb, message, note)
  tree:add(f.accept, tvb(8, 2))
  tree:add(f.reply, tvb(10, 2))
end

local function show(tree, tvb, message)
  local note = {}
  tree:add(f.confirm, tvb(0, 2))
  tree:add(f.pass, tvb(2, 2))
  tree:add(f.code, tvb(4, 2))
  if message.is.kind == "status" then
    add_status(tree, tvb, message, note)
  else
    add_header(tree, tvb, message, note)
    local add = message.is.kind == "motion" and add_motion or add_registers
    add(tree, tvb, message, note)
  end
  if tvb:len() > message.len then
    local range = tvb(message.len)
    tree:add(f.surplus, range):add_proto_expert_info(e.surplus)
    table.insert(note, string.format("%d bytes after the layout", range:len()))
  end
  return FUNCTIONS[message.code] .. ": " .. table.concat(note, ", ")
end

-- What can be said of bytes that are no message.
local function show_malformed(tree, tvb, bad)
  if tvb:len() >= 6 then
    tree:add(f.confirm, tvb(0, 2))
    tree:add(f.pass, tvb(2, 2))
    tree:add(f.code, tvb(4, 2))
  end
  local words = string.format("byte %d: %s", bad.byte, bad.why)
  tree:add(f.bad_byte, bad.byte):set_generated()
  tree:add(f.bad_why, bad.why):set_generated()
  tree:add_proto_expert_info(e.malformed, words)
  return "malformed: " .. words
end

function kinocue.dissector(tvb, pinfo, tree)
  pinfo.cols.protocol = "kinocue"
  local subtree = tree:add(kinocue, tvb())
  local info
  if tvb:len() < tvb:reported_len() then
    info = string.format("cut: the capture kept %d of %d bytes", tvb:len(), tvb:reported_len())
    subtree:add_proto_expert_info(e.cut, info)
  else
    local message, bad = read(tvb)
    if message then
      match_reply(tvb, pinfo, message)
      info = show(subtree, tvb, message)
      add_answered(subtree, pinfo)
    else
      info = show_malformed(subtree, tvb, bad)
    end
  end
  subtree:append_text(", " .. info)
  pinfo.cols.info = info
  return tvb:len()
end

-- On other ports only what opens like a message is taken for one.
local function heuristic(tvb, pinfo, tree)
  if tvb:len() < 10 or u16(tvb, 2) ~= 0 then
    return false
  end
  local confirm, code = u16(tvb, 0), u16(tvb, 4)
  local is = FAMILIES[math.floor(code / 256)]
  if not FUNCTIONS[code] or confirm ~= (is.servo and CONFIRM_SERVO or CONFIRM_CONTROLLER) then
    return false
  end
  kinocue.dissector(tvb, pinfo, tree)
  return true
end

local udp_ports = DissectorTable.get("udp.port")
udp_ports:add(CONTROLLER_PORT, kinocue)
udp_ports:add(HOST_PORT, kinocue)
kinocue:register_heuristic("udp", heuristic)
