//! `kinocue convert` and `edit`, as a person runs them: exit codes, messages, and what is on the disk afterwards.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use tempfile::{TempDir, tempdir};

/// Runs `kinocue convert` in a folder; returns its exit code and what it said.
fn convert(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    run("convert", folder, args)
}

/// The same of `kinocue edit`.
fn edit(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    run("edit", folder, args)
}

fn run(command: &str, folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = Command::cargo_bin("kinocue")
        .expect("the program is built")
        .arg(command)
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the program runs");
    assert!(output.stdout.is_empty(), "human text goes to stderr");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn folder_with(name: &str, content: impl AsRef<[u8]>) -> TempDir {
    let folder = tempdir().expect("there is room for a folder");
    fs::write(folder.path().join(name), content).expect("there is room for a file");
    folder
}

const CUE: &str = "# kinocue-csv: 1\n# title: Storm\n# units: mm\n# interpolation: spline\n\
                   time_ms,a1,v1_hz,v1_amp,fx_air\n0,0.1,0,0,1\n16.666667,0.30000000000000004,20,1.5,0\n";

#[test]
fn a_cue_comes_back_from_mcap_as_it_was() {
    let folder = folder_with("a.csv", CUE);
    let (code, said) = convert(folder.path(), &["a.csv", "b.mcap"]);
    assert_eq!((code, said.as_str()), (Some(0), "b.mcap: 2 rows, 1 axis, 00:00.016\n"));
    assert_eq!(convert(folder.path(), &["b.mcap", "c.csv"]).0, Some(0));
    assert_eq!(fs::read_to_string(folder.path().join("c.csv")).unwrap(), CUE);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3, "no other file is left");
}

#[test]
fn rows_and_bytes_are_imported() {
    let folder = folder_with("r.csv", "line,time_ms,x,y\n1,1000,0,10\n2,500,150,20\n");
    let (code, _) =
        convert(folder.path(), &["r.csv", "o.csv", "--from", "rows", "--units", "mm", "--title", "T"]);
    assert_eq!(code, Some(0));
    assert_eq!(
        fs::read_to_string(folder.path().join("o.csv")).unwrap(),
        "# kinocue-csv: 1\n# title: T\n# units: mm\n# interpolation: linear\n\
         time_ms,a1,a2\n0,0,10\n1000,0,10\n1500,150,20\n"
    );
    let folder = folder_with("r.u8", [0, 255, 51, 0]);
    assert_eq!(
        convert(folder.path(), &["r.u8", "o.csv", "--from", "u8", "--axes", "2", "--rate", "20"]).0,
        Some(0)
    );
    assert_eq!(
        fs::read_to_string(folder.path().join("o.csv")).unwrap(),
        "# kinocue-csv: 1\n# units: fraction\n# interpolation: monotone\ntime_ms,a1,a2\n0,0,1\n50,0.2,0\n"
    );
}

#[test]
fn a_spreadsheet_is_converted_by_the_very_command_that_its_refusal_offers() {
    let name = "it's a \"cue\" $x.csv";
    let text = "# title: A nod, then 1.5 bows\n# units: mm, deg\nTime_ms;A1;A2;fx_air\n0;0;0;0,0\n1000;0,5;-0,25;1,0\n";
    let folder = folder_with(name, text);
    let (code, said) = convert(folder.path(), &[name, "no.csv"]);
    assert_eq!(code, Some(65), "{said}");
    let offered = said.split('`').nth(1).expect("a command is offered").replace("kinocue ", "\"$KINOCUE\" ");
    let run = std::process::Command::new("sh")
        .args(["-c", &offered])
        .env("KINOCUE", assert_cmd::cargo::cargo_bin("kinocue"))
        .current_dir(folder.path())
        .output()
        .expect("there is a shell");
    assert!(run.status.success(), "{offered}: {}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(
        fs::read_to_string(folder.path().join("OUT.csv")).unwrap(),
        "# kinocue-csv: 1\n# title: A nod, then 1.5 bows\n# units: mm, deg\n# interpolation: spline\n\
         time_ms,a1,a2,fx_air\n0,0,0,0\n1000,0.5,-0.25,1\n"
    );
    let (code, said) = convert(folder.path(), &[name, "no.csv", "--from", "csv", "--units", "mm"]);
    assert!(code == Some(64) && said.contains("--from csv takes no --units"), "{said}");
}

#[test]
fn nothing_is_guessed_and_nothing_overwritten() {
    let folder = folder_with("a.csv", CUE);
    fs::write(folder.path().join("b.csv"), "old").unwrap();
    for (args, expected) in [
        (&["a.csv", "c.csv", "--from", "rows"][..], "--units"),
        (&["a.csv", "c.csv", "--from", "u8", "--axes", "3"], "--rate"),
        (&["a.csv", "c.csv", "--units", "mm"], "--from"),
        (
            &["a.csv", "c.csv", "--from", "rows", "--units", "cm"],
            "units are fraction, percent, u8, mm, deg or pulse",
        ),
        (&["a.csv", "c.xml"], "has to end in .csv or .mcap"),
        (&["a.csv", "b.csv"], "b.csv exists; --force replaces it"),
    ] {
        let (code, said) = convert(folder.path(), args);
        assert!(code == Some(64) && said.contains(expected), "{args:?}: {code:?} {said}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("b.csv")).unwrap(), "old");
    assert_eq!(convert(folder.path(), &["a.csv", "b.csv", "--force"]).0, Some(0));
    assert_eq!(fs::read_to_string(folder.path().join("b.csv")).unwrap(), CUE);
}

#[test]
fn bad_input_is_named_and_writes_nothing() {
    let folder = folder_with("a.csv", "time_ms,a1\n0,0\n1,2\n2,x\n");
    let (code, said) = convert(folder.path(), &["a.csv", "b.mcap"]);
    assert_eq!(code, Some(65));
    assert_eq!(
        said,
        "a.csv:3:3: a1: 2 is outside the stroke, 0 to 1\na.csv:4:3: a1: \"x\" is not a number\n"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(
        convert(folder.path(), &["none.csv", "b.csv"]),
        (Some(66), "none.csv: no such file\n".to_owned())
    );
    assert_eq!(
        convert(folder.path(), &[".", "b.csv"]),
        (Some(66), ".: is a folder, not a cue file\n".to_owned())
    );
    fs::write(folder.path().join("a.csv"), CUE).unwrap();
    let (code, said) = convert(folder.path(), &["a.csv", "nowhere/b.csv"]);
    assert!(code == Some(74) && said.starts_with("kinocue: cannot write nowhere/"), "{said}");
}

#[test]
fn a_cut_file_is_recovered_on_request() {
    let rows: String =
        (0..5000).map(|k| format!("{},{}\n", k * 10, (f64::from(k) * 0.618).fract())).collect();
    let folder = folder_with("a.csv", format!("time_ms,a1\n{rows}"));
    assert_eq!(convert(folder.path(), &["a.csv", "b.mcap"]).0, Some(0));
    let whole = fs::read(folder.path().join("b.mcap")).unwrap();
    fs::write(folder.path().join("cut.mcap"), &whole[..whole.len() / 2]).unwrap();
    let (code, said) = convert(folder.path(), &["cut.mcap", "c.csv"]);
    assert!(
        code == Some(65) && said.starts_with("cut.mcap: the file is cut short; `kinocue convert --recover`"),
        "{said}"
    );
    let (code, said) = convert(folder.path(), &["--recover", "cut.mcap", "c.csv"]);
    assert!(code == Some(0) && said.contains("the rest is lost"), "{said}");
    assert!(fs::read_to_string(folder.path().join("c.csv")).unwrap().lines().count() > 1000);
}

/// 30 mm up within two seconds, and there for one.
const RISE: &str = "# units: mm\n# interpolation: monotone\ntime_ms,a1\n0,0\n1000,15\n2000,30\n3000,30\n";

#[test]
fn an_edit_writes_a_new_cue_and_never_over_another_unless_told() {
    let folder = folder_with("rise.csv", RISE);
    let (code, said) = edit(folder.path(), &["cut", "rise.csv", "--from", "2", "-o", "top.csv"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("top.csv: 2 rows, 1 axis, 00:01.000") && said.contains("keeps all limits"),
        "{said}"
    );
    let top = || fs::read_to_string(folder.path().join("top.csv")).unwrap();
    assert!(top().ends_with("\n0,30\n1000,30\n"), "{}", top());
    for args in [["cut", "rise.csv", "-o", "top.csv"], ["cut", "rise.csv", "-o", "rise.csv"]] {
        let (code, said) = edit(folder.path(), &args);
        assert!(code == Some(64) && said.contains("--force replaces it"), "{said}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("rise.csv")).unwrap(), RISE);
    assert_eq!(
        edit(folder.path(), &["mirror", "rise.csv", "--axes", "1", "-o", "top.csv", "--force"]).0,
        Some(0)
    );
    assert!(top().contains("\n2000,120\n"), "{}", top());
}

#[test]
fn an_edit_says_where_its_cue_jumps_and_which_limits_it_breaks() {
    let folder = folder_with("rise.csv", RISE);
    let (code, said) = edit(folder.path(), &["join", "rise.csv", "rise.csv", "-o", "two.csv"]);
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("two.csv: a1 jumps by 30.000 mm at 00:03.000, where the cues meet; --gap 2s"),
        "{said}"
    );
    assert!(said.contains("two.csv: is written, and breaks limits") && said.contains("a1: jerk"), "{said}");
    let (code, said) =
        edit(folder.path(), &["join", "rise.csv", "rise.csv", "--gap", "3s", "-o", "apart.csv"]);
    assert!(code == Some(0) && !said.contains("jumps"), "{said}");
    let (code, said) = edit(folder.path(), &["mark", "rise.csv", "top", "--at", "2", "-o", "marked.csv"]);
    assert!(code == Some(64) && said.contains("CSV has no place for markers"), "{said}");
    assert_eq!(
        edit(folder.path(), &["mark", "rise.csv", "top", "--at", "2", "-o", "marked.mcap"]).0,
        Some(0)
    );
    let (code, said) =
        edit(folder.path(), &["scale", "rise.csv", "--by", "50%", "--axes", "2", "-o", "no.csv"]);
    assert!(code == Some(64) && said.contains("there is no axis 2; the cue has 1"), "{said}");
}

#[test]
fn a_fade_leaves_park_and_comes_back_and_is_within_all_limits() {
    let folder =
        folder_with("stand.csv", "# units: mm\ntime_ms,a1,v1_hz,v1_amp\n0,40,20,0.2\n8000,40,20,0.2\n");
    let (code, said) =
        edit(folder.path(), &["fade", "stand.csv", "--in", "3s", "--out", "3s", "-o", "soft.csv"]);
    assert_eq!(code, Some(0), "{said}");
    let text = fs::read_to_string(folder.path().join("soft.csv")).unwrap();
    let cells = |at: &str| text.lines().find_map(|line| line.strip_prefix(at)).map(str::to_owned);
    assert_eq!(cells("0,").as_deref(), Some("0,20,0"), "{text}");
    assert_eq!(cells("8000,").as_deref(), Some("0,20,0"), "{text}");
    assert!(cells("5000,").is_some_and(|cells| cells.starts_with("40,20,0.2")), "{text}");
}

/// A hall with two types of seats: one parks at the lower end, one in the middle.
const HALL_OF_TWO: &str = "[show]\nbind = \"127.0.0.1:8712\"\n\
    [seat.low]\naxes = 1\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\n\
    max_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n\
    [seat.mid]\naxes = 1\nstroke_mm = 300.0\nlead_mm = 5.0\npulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\n\
    max_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\npark = [0.5]\n\
    [[controller]]\nname = \"A1\"\nseat = \"low\"\naddress = \"127.0.0.1:7908\"\n\
    [[controller]]\nname = \"B1\"\nseat = \"mid\"\naddress = \"127.0.0.1:7909\"\n";

#[test]
fn a_remedy_that_an_edit_names_works_and_where_none_does_none_is_named() {
    let folder = folder_with("rise.csv", RISE);
    // A jump in the middle of a short cue: only a low-pass cures it.
    let (code, said) = edit(folder.path(), &["join", "rise.csv", "rise.csv", "-o", "two.csv"]);
    assert_eq!(code, Some(1), "{said}");
    let remedy = said.lines().find_map(|line| line.split_once("; kinocue fit ").map(|(_, rest)| rest));
    let remedy = remedy.and_then(|rest| rest.strip_suffix(" makes one that keeps them"));
    match remedy {
        Some(remedy) => {
            let remedy = remedy.replace("OUT", "fit.csv");
            let args: Vec<&str> = remedy.split(' ').collect();
            let (code, said) = run("fit", folder.path(), &args);
            assert_eq!(code, Some(0), "{remedy}: {said}");
        }
        None => {
            assert!(said.contains("kinocue fit cannot mend that"), "{said}");
            for more in [&[][..], &["--smooth"]] {
                let args = [&["two.csv", "-o", "fit.csv"], more].concat();
                assert_eq!(run("fit", folder.path(), &args).0, Some(1), "{args:?}");
            }
        }
    }
    let (code, said) = edit(
        folder.path(),
        &["replace", "two.csv", "--with", "rise.csv", "--at", "1", "--blend", "0s", "-o", "mixed.csv"],
    );
    assert!(code == Some(1) && said.contains("jumps") && said.contains("; --blend SPAN"), "{said}");
    assert!(!said.contains("--gap"), "{said}");
}

#[test]
fn an_edit_of_what_nothing_can_play_ends_as_a_check_of_it_does() {
    let folder = folder_with("turn.csv", "# units: deg\ntime_ms,a1\n0,10\n5000,20\n");
    let (code, said) = edit(folder.path(), &["mirror", "turn.csv", "--axes", "1", "-o", "back.csv"]);
    assert_eq!(code, Some(65), "{said}");
    assert!(said.contains("cannot be played; kinocue fit cannot mend that"), "{said}");
}

#[test]
fn a_hall_whose_seats_park_elsewhere_has_no_fade_but_one_of_a_type() {
    let folder =
        folder_with("rise.csv", "# interpolation: monotone\ntime_ms,a1\n0,0.5\n4000,0.6\n8000,0.5\n");
    fs::write(folder.path().join("two.toml"), HALL_OF_TWO).unwrap();
    let fade = ["fade", "rise.csv", "--in", "3s", "--config", "two.toml", "-o", "soft.csv"];
    let (code, said) = edit(folder.path(), &fade);
    assert_eq!(code, Some(64), "{said}");
    assert!(said.contains("park pose of seat type low is 0, of mid 0.5; --seat NAME"), "{said}");
    assert!(!folder.path().join("soft.csv").exists());
    let (code, said) = edit(folder.path(), &[&fade[..], &["--seat", "mid"]].concat());
    assert_eq!(code, Some(0), "{said}");
    assert!(fs::read_to_string(folder.path().join("soft.csv")).unwrap().contains("\n0,0.5\n"));
}

#[test]
fn a_cue_that_is_edited_in_place_keeps_its_mode_its_link_its_comments_and_its_columns() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let folder = folder_with(
        "true.csv",
        "# author: Ada\n# units: mm\n#\n# interpolation: monotone\ntime_ms,a1,dac1\n0,10,0\n3000,20,0.5\n",
    );
    let at = |name: &str| folder.path().join(name);
    fs::set_permissions(at("true.csv"), fs::Permissions::from_mode(0o640)).unwrap();
    fs::create_dir(at("links")).unwrap();
    symlink("../true.csv", at("links/a.csv")).unwrap();
    let (code, said) =
        edit(folder.path(), &["mirror", "links/a.csv", "--axes", "1", "-o", "links/a.csv", "--force"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(fs::symlink_metadata(at("links/a.csv")).unwrap().is_symlink());
    assert_eq!(fs::metadata(at("true.csv")).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(
        fs::read_to_string(at("true.csv")).unwrap(),
        "# kinocue-csv: 1\n# units: mm\n# interpolation: monotone\n# author: Ada\n#\ntime_ms,a1,dac1\n0,140,0\n3000,130,0.5\n"
    );
    assert_eq!(fs::read_dir(at("links")).unwrap().count(), 1, "nothing is left beside the link");
    let (code, said) = edit(folder.path(), &["mirror", "true.csv", "--axes", "1", "-o", "a.mcap"]);
    assert!(code == Some(0) && said.contains("true.csv: 2 lines of comments are left out"), "{said}");
    fs::create_dir(at("d.csv")).unwrap();
    let (code, said) = edit(folder.path(), &["mirror", "true.csv", "--axes", "1", "-o", "d.csv", "--force"]);
    assert!(code == Some(74) && said.contains("is no file"), "{said}");
}
