//! What one controller says is wrong with it, and the emergency stop that it tells.

use super::Why;
use crate::motion::MAX_AXES;
use crate::state::Event;

/// FaultLatch and alarms of one controller, and what of them is latched until a person clears it.
#[derive(Debug, Clone)]
pub(super) struct FaultLatch {
    controller: usize,
    /// An emergency stop is in effect.
    pub(super) pressed: bool,
    /// One was, since it was cleared.
    pub(super) tripped: bool,
    /// That one began, until the hall is told.
    press: Option<Event>,
    error: u16,
    /// The alarm that it tells of itself (MBOX): a register, and what stands there; over with 0.
    alarm: (u16, u16),
    drives: [u16; MAX_AXES],
    /// It refuses frames.
    pub(super) refusing: bool,
    /// What went wrong first since it was cleared.
    pub(super) first: Option<Why>,
}

impl FaultLatch {
    /// None yet, of this controller.
    pub(super) const fn of(controller: usize) -> Self {
        Self {
            controller,
            pressed: false,
            tripped: false,
            press: None,
            error: 0,
            alarm: (0, 0),
            drives: [0; MAX_AXES],
            refusing: false,
            first: None,
        }
    }

    pub(super) fn on_error(&mut self, error: u16) {
        self.error = error;
        if error != 0 {
            self.on_fault(Why::Error { controller: self.controller, error });
        }
    }

    pub(super) fn on_alarm(&mut self, register: u16, value: u16) {
        self.alarm = (register, value);
        if value != 0 {
            self.on_fault(Why::Alarm { controller: self.controller, register, value });
        }
    }

    /// It drives other axes than its frames lead.
    pub(super) fn on_other_axes(&mut self, drives: u16) {
        self.on_fault(Why::OtherAxes { controller: self.controller, drives });
    }

    /// It answers with registers that nobody here can read.
    pub(super) fn on_wide_registers(&mut self) {
        self.latch(Why::Wide(self.controller));
    }

    pub(super) fn on_drive(&mut self, axis: usize, error: u16) {
        let Some(known) = axis.checked_sub(1).and_then(|index| self.drives.get_mut(index)) else { return };
        *known = error;
        if error != 0 {
            self.on_fault(Why::Drive { controller: self.controller, axis, error });
        }
    }

    /// A drive let go of its motor. It tells no end of that, and its motor is held again once it is homed: that is all that ends it.
    pub(super) fn on_killed(&mut self, axis: usize, cause: u16) {
        self.on_fault(Why::Killed { controller: self.controller, axis, cause });
    }

    /// It was homed: its drives hold their motors.
    pub(super) fn on_homed(&mut self) {
        self.first.take_if(|why| matches!(why, Why::Killed { .. }));
    }

    /// The first that went wrong counts; but that frames are refused is soon explained by what is read.
    fn on_fault(&mut self, why: Why) {
        if self.first.is_none_or(|before| matches!(before, Why::Refuses(_))) {
            self.first = Some(why);
        }
    }

    pub(super) fn on_refused(&mut self) {
        self.refusing = true;
        self.latch(Why::Refuses(self.controller));
    }

    /// It took a frame.
    pub(super) const fn on_frame_taken(&mut self) {
        self.refusing = false;
    }

    /// Keeps why it is out until a person clears it, unless something else came first.
    pub(super) fn latch(&mut self, why: Why) {
        self.first.get_or_insert(why);
    }

    pub(super) const fn on_emergency_stop(&mut self, pressed: bool) {
        if pressed && !self.pressed {
            self.press = Some(Event::EmergencyStop(self.controller));
        }
        self.tripped |= pressed;
        self.pressed = pressed;
    }

    /// Nobody presses the emergency stop any more.
    pub(super) const fn on_released(&mut self) {
        self.pressed = false;
    }

    /// What the hall is to hear of it: an emergency stop that began since the last time.
    pub(super) const fn take_press(&mut self) -> Option<Event> {
        self.press.take()
    }

    /// True if something is still wrong with it.
    pub(super) fn go_on(&self) -> bool {
        self.error != 0 || self.alarm.1 != 0 || self.refusing || self.drives.iter().any(|error| *error != 0)
    }

    /// What was latched is over, unless it goes on: true if it is.
    pub(super) fn clear(&mut self) -> bool {
        // Whether it would still refuse frames, only the next frame can tell.
        self.refusing = false;
        self.tripped = self.pressed;
        let is_over = !self.go_on();
        if is_over {
            self.first = None;
        }
        is_over
    }
}
