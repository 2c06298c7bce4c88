//! What is shipped beside the program: the package names only what exists, examples that drive nothing by themselves, a unit
//! that gives nothing away, manual pages for every command.

#[path = "common/programs.rs"]
mod programs;
#[path = "common/script.rs"]
mod script;

use std::collections::BTreeSet;
use std::fs;
use std::net::SocketAddr;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use programs::is_installed;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn toml(path: &str) -> toml::Table {
    text(path).parse().unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn kinocue(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    command.current_dir(root()).args(args).output().expect("kinocue runs")
}

/// What a tool says; none where its tests are to be skipped.
fn tool(program: &str, args: &[&str]) -> Option<Output> {
    is_installed(program)
        .then(|| Command::new(program).current_dir(root()).args(args).output().expect("it is installed"))
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The files that a pattern of the package means; those of `target` are built for it.
fn files(pattern: &str) -> Vec<PathBuf> {
    let (folder, name) = pattern.rsplit_once('/').unwrap_or((".", pattern));
    let Some((front, back)) = name.split_once('*') else { return vec![root().join(pattern)] };
    let entries = fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let fits = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(front) && name.ends_with(back)
    };
    paths.filter(fits).collect()
}

#[test]
fn every_file_that_the_package_names_exists() {
    let manifest = toml("Cargo.toml");
    let deb = manifest["package"]["metadata"]["deb"].as_table().unwrap();
    let assets = deb["assets"].as_array().unwrap();
    let sources = assets.iter().map(|asset| asset[0].as_str().unwrap());
    for source in sources.filter(|source| !source.starts_with("target/")) {
        let found = files(source);
        assert!(!found.is_empty() && found.iter().all(|path| path.is_file()), "{source}: {found:?}");
    }
    assert!(root().join(deb["license-file"][0].as_str().unwrap()).is_file());
    assert_eq!(files("systemd/debian/p*").len(), 3, "the maintainer scripts");
    let of_version = format!("kinocue ({}-1) ", env!("CARGO_PKG_VERSION"));
    assert!(text(deb["changelog"].as_str().unwrap()).starts_with(&of_version), "{of_version}");
}

#[test]
fn every_path_of_the_unit_is_one_that_the_package_installs() {
    let manifest = toml("Cargo.toml");
    let assets = manifest["package"]["metadata"]["deb"]["assets"].as_array().unwrap();
    let targets: Vec<_> = assets.iter().map(|asset| asset[1].as_str().unwrap()).collect();
    let unit = text("systemd/kinocue.service");
    let start = "serve --config /etc/kinocue/kinocue.toml --fleet-socket /run/kinocue-fleet/fleet.sock";
    assert!(unit.contains(&format!("\nExecStart=/usr/bin/kinocue {start}\n")));
    let link = text("systemd/kinocue-link.service");
    let start = "fleet link --config /etc/kinocue/fleet.toml --socket /run/kinocue-fleet/fleet.sock";
    assert!(
        link.contains(&format!("\nExecStart=/usr/bin/kinocue {start}\n")),
        "where the hall has its socket"
    );
    assert!(targets.contains(&"usr/bin/") && targets.contains(&"usr/lib/systemd/system/"));
    assert!(!targets.iter().any(|target| target.starts_with("etc/")), "no configuration is installed");
}

#[test]
fn installing_and_upgrading_start_nothing() {
    for script in ["postinst", "postrm"] {
        let text = text(&format!("systemd/debian/{script}"));
        let commands =
            text.lines().map(str::trim).filter(|line| !line.starts_with("echo") && !line.starts_with('"'));
        for line in commands.filter(|line| line.contains("systemctl")) {
            assert!(line.contains("daemon-reload") || line.contains("is-active"), "{script}: {line}");
        }
    }
}

#[test]
fn the_examples_pass_their_check() {
    for example in ["systemd/kinocue.toml", "systemd/simulated.toml"] {
        let output = kinocue(&["check", example]);
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
fn the_simulated_hall_reaches_nothing_but_this_machine() {
    let hall = toml("systemd/simulated.toml");
    let controllers = hall["controller"].as_array().unwrap();
    let addresses = controllers.iter().map(|one| one["address"].as_str().unwrap());
    for address in addresses.chain([hall["show"]["bind"].as_str().unwrap()]) {
        let address: SocketAddr = address.parse().unwrap();
        assert!(address.ip().is_loopback(), "{address}");
    }
    let rows: std::collections::BTreeSet<_> =
        controllers.iter().map(|one| one["row"].as_str().unwrap()).collect();
    assert_eq!(rows.len(), 2);
}

#[test]
fn the_units_are_as_closed_as_they_were_measured_to_be() {
    // Exposure in tenths; ends with a failure above it.
    for (unit, most) in [
        ("systemd/kinocue.service", "12"),
        ("systemd/kinocue-sync.service", "6"),
        ("systemd/kinocue-buttons.service", "6"),
        ("systemd/kinocue-link.service", "12"),
        ("systemd/kinocue-desk.service", "12"),
    ] {
        let most = format!("--threshold={most}");
        if let Some(output) = tool("systemd-analyze", &["security", "--offline=true", &most, unit]) {
            assert!(output.status.success(), "{}", said(&output));
        }
    }
}

#[test]
fn the_units_let_nothing_run_with_rights() {
    for (name, user) in [
        ("kinocue", "User=kinocue"),
        ("kinocue-sync", "User=kinocue-sync"),
        ("kinocue-buttons", "User=kinocue-buttons"),
        ("kinocue-link", "User=kinocue-link"),
        ("kinocue-desk", "User=kinocue-desk"),
    ] {
        let unit = text(&format!("systemd/{name}.service"));
        for line in [user, "CapabilityBoundingSet=", "AmbientCapabilities=", "NoNewPrivileges=yes"] {
            assert!(unit.lines().any(|found| found == line), "{name}: {line}");
        }
        assert!(!unit.lines().any(|line| line.contains("CAP_")), "{name}: no capability is named");
    }
}

#[test]
fn no_unit_is_given_up_however_often_it_fails_and_none_is_started_again_without_a_pause() {
    for name in ["kinocue", "kinocue-sync", "kinocue-buttons", "kinocue-link", "kinocue-desk"] {
        let unit = text(&format!("systemd/{name}.service"));
        let head = unit.split("[Service]").next().unwrap();
        assert!(head.lines().any(|line| line == "StartLimitIntervalSec=0"), "{name}");
        assert!(unit.lines().any(|line| line == "Restart=on-failure"), "{name}");
        let pause = unit.lines().find_map(|line| line.strip_prefix("RestartSec=")?.strip_suffix('s'));
        let pause: f64 = pause.and_then(|seconds| seconds.parse().ok()).unwrap_or_default();
        assert!((1.0..=5.0).contains(&pause), "{name}: {pause} s");
    }
}

#[test]
fn no_unit_lets_a_program_be_made_in_memory_where_no_mount_forbids_it_to_run() {
    let folder = std::fs::read_dir("systemd").unwrap().map(|entry| entry.unwrap().path());
    let units: Vec<_> =
        folder.filter(|path| path.extension().is_some_and(|kind| kind == "service")).collect();
    assert!(units.len() >= 5, "{units:?}");
    for name in units {
        let unit = std::fs::read_to_string(&name).unwrap();
        let name = name.display();
        let mut refused = unit.lines().filter_map(|line| line.strip_prefix("SystemCallFilter=~"));
        assert!(refused.any(|calls| calls.split(' ').any(|call| call == "memfd_create")), "{name}");
        assert!(unit.lines().any(|line| line == "MemoryDenyWriteExecute=yes"), "{name}");
    }
}

#[test]
fn who_reads_devices_has_no_network_and_who_moves_seats_no_device() {
    let hall = text("systemd/kinocue.service");
    let has = |unit: &str, line: &str| unit.lines().any(|found| found == line);
    assert!(has(&hall, "PrivateDevices=yes") && !hall.contains("\nDeviceAllow"));
    let bound: Vec<&str> = hall.lines().filter_map(|line| line.strip_prefix("BindReadOnlyPaths=")).collect();
    for name in ["kinocue-sync", "kinocue-buttons"] {
        let (unit, folder) = (text(&format!("systemd/{name}.service")), format!("/run/{name}"));
        assert!(has(&unit, "PrivateNetwork=yes") && has(&unit, "RestrictAddressFamilies=AF_UNIX"), "{name}");
        // The folder of the sockets is one that the one may write and the other read.
        assert!(has(&unit, &format!("ReadWritePaths={folder}")), "{name}");
        assert!(bound.join(" ").split_whitespace().any(|path| path == format!("-{folder}")), "{name}");
        let tmpfiles = text("systemd/kinocue.tmpfiles");
        let mut made = tmpfiles.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        assert!(made.any(|line| line == ["d", &folder, "0750", name, "kinocue", "-"]), "{name}");
    }
    let folder = "/run/kinocue-sync";
    let help = kinocue(&["sync", "relay", "--help"]);
    assert!(said(&help).contains(folder), "it is where the sockets are unless another is named");
}

#[test]
fn serial_lines_are_the_only_devices_of_the_drop_in_for_drives_which_nobody_gets_unasked() {
    let drop_in = text("systemd/kinocue-drives.conf");
    let allowed: Vec<_> = drop_in.lines().filter_map(|line| line.strip_prefix("DeviceAllow=")).collect();
    assert_eq!(allowed, ["char-ttyUSB rw", "char-ttyACM rw", "char-ttyS rw"]);
    for line in ["DevicePolicy=closed", "SupplementaryGroups=dialout", "RestrictAddressFamilies=AF_CAN"] {
        assert!(drop_in.lines().any(|found| found == line), "{line}");
    }
    assert!(!drop_in.contains("CAP_") && !drop_in.contains("ExecStart"));
    let rule = text("systemd/60-kinocue-drives.rules");
    let rules: Vec<_> = rule.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(
        rules,
        [r#"ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1""#]
    );
    let manifest = toml("Cargo.toml");
    let assets = manifest["package"]["metadata"]["deb"]["assets"].as_array().unwrap();
    for (file, name) in [(drop_in, "kinocue-drives.conf"), (rule, "60-kinocue-drives.rules")] {
        let asset = assets.iter().find(|asset| asset[0].as_str().unwrap().ends_with(name)).unwrap();
        let folder = asset[1].as_str().unwrap();
        assert_eq!(folder, "usr/share/kinocue/drives/", "where neither systemd nor udev looks");
        assert!(file.contains(&format!("/{folder}{name} /etc/")), "{name} says how it is installed");
    }
}

#[test]
fn alerts_are_what_prometheus_takes_and_are_raised_where_they_should_be_and_nowhere_else() {
    if let Some(output) = tool("promtool", &["check", "rules", "systemd/prometheus/kinocue.rules.yml"]) {
        assert!(output.status.success(), "{}", said(&output));
    }
    for cases in ["film", "fleet"] {
        let cases = format!("tests/data/prometheus/{cases}.test.yml");
        if let Some(output) = tool("promtool", &["test", "rules", &cases]) {
            assert!(output.status.success(), "{}", said(&output));
        }
    }
}

#[test]
fn every_expression_of_the_dashboard_is_one_that_prometheus_takes() {
    let board: serde_json::Value = serde_json::from_str(&text("systemd/grafana/kinocue.json")).unwrap();
    let targets =
        board["panels"].as_array().unwrap().iter().flat_map(|panel| panel["targets"].as_array().unwrap());
    let expressions: Vec<String> =
        targets.map(|target| target["expr"].as_str().unwrap().replace("$__rate_interval", "1m")).collect();
    assert!(expressions.len() > 20);
    // A text of JSON is one of YAML.
    let rules = expressions
        .iter()
        .enumerate()
        .map(|(at, expr)| serde_json::json!({"record": format!("of:{at}"), "expr": expr}));
    let groups = serde_json::json!({"groups": [{"name": "dashboard", "rules": rules.collect::<Vec<_>>()}]});
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("dashboard.yml");
    fs::write(&file, groups.to_string()).unwrap();
    if let Some(output) = tool("promtool", &["check", "rules", file.to_str().unwrap()]) {
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
fn every_library_in_the_program_may_be_passed_on_with_its_licence() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("third-party.txt");
    if let Some(output) = tool("python3", &["-B", "systemd/third_party.py", list.to_str().unwrap()]) {
        assert!(output.status.success(), "{}", said(&output));
        let list = fs::read_to_string(list).unwrap();
        assert!(list.contains("\nrustix "));
        assert!(list.contains("Copyright (c) 2011-2020, Yann Collet"), "and what a library compiles in");
    }
}

/// Name, version and licence of all that cargo finds by such edges below the program, itself left out.
fn needed(edges: &str) -> BTreeSet<[String; 3]> {
    let asked = ["tree", "--locked", "--prefix", "none", "--format", "{p}|{l}", "--edges", edges];
    let output = tool("cargo", &asked).expect("cargo runs the tests");
    let lines = String::from_utf8(output.stdout).expect("cargo prints text");
    let parts = lines.lines().filter(|line| !line.starts_with("kinocue ")).map(|line| {
        let (package, licence) = line.trim_end_matches(" (*)").split_once('|').expect("as the format says");
        let (name, version) = package.split_once(" v").expect("a version");
        let version = version.split(' ').next().expect("a version");
        [name.to_owned(), version.to_owned(), licence.replace(" / ", "/").replace('/', " OR ")]
    });
    parts.collect()
}

#[test]
fn the_list_for_machines_names_each_part_with_its_version_and_licence_and_whether_it_is_in_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("kinocue.cdx.json");
    let texts = folder.path().join("third-party.txt");
    let asked = ["-B", "systemd/third_party.py", texts.to_str().unwrap(), list.to_str().unwrap()];
    let Some(output) = tool("python3", &asked) else { return };
    assert!(output.status.success(), "{}", said(&output));
    let list: serde_json::Value = serde_json::from_str(&fs::read_to_string(list).unwrap()).unwrap();
    assert_eq!((&list["bomFormat"], &list["specVersion"]), (&"CycloneDX".into(), &"1.5".into()));
    let components = list["components"].as_array().unwrap();
    let listed = |scope: &str| -> BTreeSet<[String; 3]> {
        let parts = components.iter().filter(|part| part["scope"] == scope);
        let fields = |part: &serde_json::Value| {
            [&part["name"], &part["version"], &part["licenses"][0]["expression"]]
                .map(|field| field.as_str().unwrap().to_owned())
        };
        parts.map(fields).collect()
    };
    let (inside, all) = (needed("normal,no-proc-macro"), needed("normal,build"));
    assert!(inside.len() > 200 && all.len() > inside.len(), "{} of {}", inside.len(), all.len());
    let more: BTreeSet<_> = listed("required").difference(&inside).cloned().collect();
    let names: Vec<&str> = more.iter().map(|[name, ..]| name.as_str()).collect();
    assert_eq!(names, ["lz4", "std", "uplot"], "what comes from elsewhere");
    assert_eq!(inside.difference(&listed("required")).next(), None);
    assert_eq!(listed("excluded"), all.difference(&inside).cloned().collect());
    let lock = toml("Cargo.lock");
    let packages = lock["package"].as_array().unwrap();
    for part in components.iter().filter(|part| part["purl"].as_str().unwrap().starts_with("pkg:cargo/")) {
        let of = |key: &str| part[key].as_str().unwrap();
        let is_it = |one: &&toml::Value| {
            one["name"].as_str() == Some(of("name")) && one["version"].as_str() == Some(of("version"))
        };
        let locked = packages.iter().find(is_it).unwrap();
        assert_eq!(part["hashes"][0]["content"].as_str(), locked["checksum"].as_str(), "{}", of("name"));
    }
}

/// The sources of the program in a folder of their own, with what stands for a built program there.
fn sources_elsewhere() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(root()).expect("it is ours") {
        let entry = entry.expect("it is ours");
        if !["target", ".git"].iter().any(|name| entry.file_name() == *name) {
            symlink(entry.path(), folder.path().join(entry.file_name())).expect("the folder is ours");
        }
    }
    let built = folder.path().join("target/dist");
    fs::create_dir_all(&built).expect("the folder is ours");
    let program = |name: &str, text: String| {
        let path = built.join(name);
        script::make(&path, &format!("#!/bin/sh\n{text}\n"));
    };
    program("kinocue", format!("exec '{}' \"$@\"", env!("CARGO_BIN_EXE_kinocue")));
    program("cargo-deb", "exit 1".to_owned()); // which would strip the program: it is none
    folder
}

#[test]
fn the_package_of_the_same_sources_is_the_same_to_the_bit_whoever_packs_it_wherever_and_whenever() {
    if !is_installed("dpkg-deb") || !is_installed("python3") {
        return;
    }
    let pack = |umask: &str, zone: &str| {
        let folder = sources_elsewhere();
        let path = format!("{}/target/dist:{}", folder.path().display(), std::env::var("PATH").unwrap());
        let mut command = Command::new("bash");
        command.args(["-c", "umask $0 && exec systemd/build-deb.sh --no-build", umask]);
        command.current_dir(folder.path()).env("PATH", path).env("TZ", zone);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        let mut packages = fs::read_dir(folder.path().join("target/debian")).unwrap();
        fs::read(packages.next().unwrap().unwrap().path()).unwrap()
    };
    assert!(pack("022", "UTC") == pack("077", "Pacific/Kiritimati"));
}

#[test]
fn shell_scripts_are_shell_scripts() {
    let scripts = files("systemd/*.sh").into_iter().chain(files("systemd/debian/*"));
    for script in scripts {
        let output = Command::new("bash").arg("-n").arg(&script).output().unwrap();
        assert!(output.status.success(), "{}: {}", script.display(), said(&output));
    }
}

#[test]
fn python_scripts_are_python_scripts() {
    let read = "import ast, sys\nfor path in sys.argv[1:]: ast.parse(open(path).read(), path)";
    let scripts = files("systemd/*.py").into_iter().chain(files("systemd/walk/*.py"));
    let paths: Vec<String> = scripts.map(|path| path.display().to_string()).collect();
    let args: Vec<&str> = ["-c", read].into_iter().chain(paths.iter().map(String::as_str)).collect();
    if let Some(output) = tool("python3", &args) {
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
fn every_command_has_its_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let output = kinocue(&["man", folder.path().to_str().unwrap()]);
    assert!(output.status.success(), "{}", said(&output));
    let page =
        |name: &str| fs::read_to_string(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let all = page("kinocue.1");
    for command in ["play", "sim", "check", "preflight", "doctor"] {
        assert!(all.contains(&format!("kinocue\\-{command}(1)")), "{command} is in kinocue(1)");
        assert!(page(&format!("kinocue-{command}.1")).contains(".SH OPTIONS"), "{command}");
    }
    assert!(page("kinocue-register-read.1").contains(".SH OPTIONS"), "and those within commands");
    assert!(!all.contains("kinocue\\-man(1)"), "not those for whoever makes packages");
}

#[test]
fn a_folder_that_is_not_there_takes_no_manual_pages() {
    let output = kinocue(&["man", "/nonexistent/folder"]);
    assert_eq!(output.status.code(), Some(74), "{}", said(&output));
}

/// A stranger can run any fault by its number.
#[test]
fn each_test_that_the_page_of_faults_names_is_there() {
    let sources = rust_under("tests") + &rust_under("src");
    let page = text("docs/faults.md");
    let commands = page.split('`').filter(|code| code.starts_with("cargo test "));
    let names: Vec<&str> = commands.filter_map(|command| command.split_whitespace().last()).collect();
    assert!(names.len() > 100, "{}", names.len());
    for name in names {
        assert!(sources.contains(&format!("fn {name}(")), "docs/faults.md: there is no test {name}");
    }
}

#[test]
fn the_tool_that_tries_faults_knows_all_of_the_page_by_number_and_refuses_others() {
    let tool = |words: &[&str]| {
        Command::new(root().join("tools/faults")).args(words).output().expect("python3 is there")
    };
    let list = tool(&[]);
    let lines = String::from_utf8_lossy(&list.stdout).lines().count();
    assert!(list.status.success() && lines == 62, "{lines}: {}", said(&list));
    let unknown = tool(&["63"]);
    assert_eq!(unknown.status.code(), Some(1), "{}", said(&unknown));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("numbers from 1 to 62"), "{}", said(&unknown));
}

/// All sources below a folder, one behind the other.
fn rust_under(folder: &str) -> String {
    let entries = fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let each = |entry: Result<fs::DirEntry, std::io::Error>| {
        let name = entry.expect("the folder can be read").file_name();
        let path = format!("{folder}/{}", name.to_string_lossy());
        match root().join(&path) {
            below if below.is_dir() => rust_under(&path),
            _ if path.ends_with(".rs") => text(&path),
            _ => String::new(),
        }
    };
    entries.map(each).collect()
}
