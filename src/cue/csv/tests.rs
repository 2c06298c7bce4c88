use proptest::prelude::*;

use super::*;
use crate::cue::{FaultClass, Interpolation, Unit, Vibration};

fn cue(text: &str) -> Cue {
    read(Path::new("t.csv"), text.as_bytes()).unwrap_or_else(|faults| panic!("{faults}"))
}

/// The faults of a text, one a line, without the file's name.
fn faults(text: impl AsRef<[u8]>) -> String {
    let faults = read(Path::new("t.csv"), text.as_ref()).expect_err("no fault was found");
    assert_eq!(faults.class(), FaultClass::BadCue);
    faults.to_string().replace("t.csv:", "")
}

#[test]
fn a_whole_cue_is_understood() {
    let cue = cue(
        "# made by hand\n#Title: Storm \n# units: percent\n# interpolation: monotone\n# kinocue-csv: 1\n\
                   time_s,a1,a2,v1_hz,v1_amp,fx_air,fx_water\n0,0,50,0,0,0,0\n0.5,100,,20,2.5,1,\n",
    );
    assert_eq!(
        (cue.title(), cue.units().of(0), cue.interpolation()),
        (Some("Storm"), Unit::Fraction, Interpolation::Monotone)
    );
    assert_eq!((cue.axes(), cue.rows(), cue.duration()), (2, 2, ShowTime::from_millis(500)));
    assert_eq!(cue.positions(), [0.0, 0.5, 1.0, 0.5]);
    let last = cue.tracks().vibration(0).as_slice().last().map(|step| step.value.into());
    assert_eq!(last, Some(Vibration { hz: 20.0, amplitude: 0.025 }));
    assert!(cue.tracks().vibration(1).as_slice().is_empty());
    let Effects::Named { names, steps } = cue.effects() else { panic!("named effects") };
    assert_eq!((names.join(" "), steps.at(cue.duration(), &mut 0)), ("air water".to_owned(), 0b01));
    assert_eq!((cue.line(0), cue.line(1)), (7, 8));
}

#[test]
fn columns_between_semicolons_or_tabs_are_one_fault_with_a_command_that_makes_a_cue_of_them() {
    let told = faults("time_ms;a1;a2\n0;0,5;0\n100;0,6;0\n");
    assert!(told.starts_with("1:1: the columns are separated by semicolons, not by commas; "), "{told}");
    assert!(told.contains("`kinocue convert --from csv t.csv OUT.csv`"), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(faults("time_ms\ta1\n0\t0\n").contains("by tabs, not by commas; `kinocue convert"));
    assert!(
        faults("# units: mm\nsep=;\ntime_ms;a1\n0;0\n")
            .starts_with("2:1: the columns are separated by semicolons")
    );
    let named = read(Path::new("it's a cue.csv"), "time_ms|a1\n0|0\n".as_bytes()).unwrap_err().to_string();
    assert!(
        named.contains("by bars, not by commas; `kinocue convert --from csv 'it'\\''s a cue.csv' OUT.csv`"),
        "{named}"
    );
}

#[test]
fn bom_crlf_blank_lines_quotes_and_spaces_are_accepted() {
    let cue = cue("\u{feff}# units: mm\r\n\r\n time_ms , a1 ,io\r\n0,\"0.5\" ,0x5\r\n\r\n\"10\", 1e1 ,7");
    assert_eq!((cue.units().of(0), cue.positions()), (Unit::Millimetre, &[0.5, 10.0][..]));
    assert_eq!((cue.line(0), cue.line(1)), (4, 6));
    let Effects::Words(words) = cue.effects() else { panic!("raw words") };
    assert_eq!(words.at(ShowTime::ZERO, &mut 0), 5);
}

#[test]
fn an_empty_cell_holds_the_value_before_it() {
    let cue = cue("time_ms,a1,a2\n0,0.1,0.2\n1,,0.3\n2,0.4,\n");
    assert_eq!(cue.positions(), [0.1, 0.2, 0.1, 0.3, 0.4, 0.3]);
    assert_eq!(
        faults("time_ms,a1\n0,\n,1\n"),
        "2:3: a1: is empty, with no value before it to hold\n3:1: time_ms: is empty; every row needs one"
    );
}

#[test]
fn a_file_with_nothing_to_play_is_refused() {
    for text in ["", "\n \n", "# title: x\n"] {
        assert_eq!(faults(text), " is empty; a cue needs at least two rows", "{text:?}");
    }
    assert_eq!(faults("time_ms,a1\n"), " number of rows: 0; a cue needs at least two");
    assert_eq!(faults("time_ms,a1\n0,0\n"), " number of rows: 1; a cue needs at least two");
}

#[test]
fn bad_numbers_are_named_with_line_and_column() {
    assert_eq!(
        faults("time_ms,a1,a2\n0,0,0\n10,x1, nan\n20,inf,1e999\n30,\"0,5\",0\n"),
        "3:4: a1: \"x1\" is not a number\n\
         3:8: a2: nan is not a finite number\n\
         4:4: a1: inf is not a finite number\n\
         4:8: a2: 1e999 is not a finite number\n\
         5:4: a1: \"0,5\" is not a number; write 0.5"
    );
}

#[test]
fn columns_are_counted_in_characters() {
    assert_eq!(
        faults("time_ms,a1,a2\n0,0,0\n1,öäü,-1\n").lines().nth(1),
        Some("3:7: a2: -1 is outside the stroke, 0 to 1")
    );
}

#[test]
fn positions_outside_the_stroke_are_refused_in_the_unit_of_the_file() {
    assert_eq!(faults("time_ms,a1\n0,1.42\n1,0"), "2:3: a1: 1.42 is outside the stroke, 0 to 1");
    let percent = faults("time_ms,a1\n0,50\n1,0");
    assert!(percent.ends_with("write \"# units: percent\" or \"# units: mm\" above the header"), "{percent}");
    assert_eq!(
        faults("# units: percent\ntime_ms,a1\n0,100.5\n1,0"),
        "3:3: a1: 100.5 is outside the stroke, 0 to 100 %"
    );
    assert_eq!(
        faults("# units: mm\ntime_ms,a1\n0,-200000\n1,0"),
        "3:3: a1: -200000 is outside -100000 to 100000 mm, where no seat can go"
    );
}

#[test]
fn time_starts_at_0_and_increases() {
    assert_eq!(faults("time_ms,a1\n5,0\n6,0"), "2:1: time_ms: the first time is 5 and must be 0");
    assert_eq!(
        faults("time_ms,a1\n0,0\n2000,0\n2000,0\n1999.5,0\n2001,0"),
        "4:1: time_ms: 2000 is not after 00:02.000, the time before it\n\
         5:1: time_ms: 1999.5 is not after 00:02.000, the time before it"
    );
    assert_eq!(
        faults("time_s,a1\n0,0\n86401,0"),
        "3:1: time_s: 86401 is after 24:00:00.000, the latest time of a cue"
    );
    assert!(faults("time_s,a1\n0,0\n-1e308,0\n").contains("is not after"));
}

#[test]
fn ragged_rows_are_refused_and_the_next_is_read() {
    assert_eq!(
        faults("time_ms,a1,a2\n0,0,0\n1,0\n2,0,0,0\n3,0,2\n"),
        "3:4: the row ends after 2 of 3 cells\n\
         4:7: the row has 4 cells, the header 3\n\
         5:5: a2: 2 is outside the stroke, 0 to 1"
    );
    assert!(faults(format!("time_ms,a1\n0,0\n1,0{}\n", ",".repeat(500))).contains("the row has 502 cells"));
}

#[test]
fn effects_and_words_have_their_values() {
    assert_eq!(
        faults("time_ms,a1,fx_air\n0,0,2\n1,0,on"),
        "2:5: fx_air: \"2\" is neither 0 nor 1\n3:5: fx_air: \"on\" is neither 0 nor 1"
    );
    assert_eq!(
        faults("time_ms,a1,io\n0,0,0x1000\n1,0,0"),
        "2:5: io: \"0x1000\" is not an output word; 0 to 4095, or 0x0 to 0xfff, for Y01 to Y12"
    );
}

#[test]
fn vibration_must_fit_into_a_frame() {
    assert_eq!(
        faults("time_ms,a1,v1_hz,v1_amp\n0,0,0.1,0\n1,0,-1,-0.5\n2,0,8001,1"),
        "2:5: v1_hz: 0.1 Hz is neither 0 nor within 0.1221 to 8000 Hz\n\
         3:5: v1_hz: -1 Hz is neither 0 nor within 0.1221 to 8000 Hz\n\
         3:8: v1_amp: an amplitude of -0.5 is outside 0 to 1\n\
         4:5: v1_hz: 8001 Hz is neither 0 nor within 0.1221 to 8000 Hz"
    );
}

#[test]
fn declarations_that_are_not_known_are_refused_with_their_line() {
    assert_eq!(
        faults("# kinocue-csv: 2\n# units: cm\n#interpolation:bezier\n# units: mm\ntime_ms,a1\n0,0\n1,0"),
        "1:16: kinocue-csv: \"2\" is not known; this program reads version 1\n\
         2:10: units: \"cm\" is not known; units are fraction, percent, u8, mm, deg or pulse\n\
         3:16: interpolation: \"bezier\" is not known; interpolations are spline, monotone, linear or hold\n\
         4:10: units: declared twice"
    );
}

const NOD: &str = "# kinocue-csv: 1\n# title: A nod\n# units: mm, deg\n# interpolation: monotone\n";
const ROWS: &str =
    "time_ms,a1,a2,v1_hz,v1_amp,fx_air\n0,0,0,0,0,0\n1000,0.5,0.5,,,\n2000,0.7,0.3,20,0.001,1\n";

#[test]
fn a_cue_that_a_spreadsheet_saved_again_is_the_cue_that_it_was() {
    let nod = cue(&format!("{NOD}{ROWS}"));
    let padded = NOD.replace('\n', ",,,,,\r\n").replace("mm, deg,", "mm, deg");
    let quoted: String = NOD.lines().map(|line| format!("\"{line}\"\n")).collect();
    let all_quoted: String =
        ROWS.lines().map(|line| format!("\"{}\",\"\"\n", line.replace(',', "\",\""))).collect();
    let tall = "time_ms,a1,a2,v1_hz,v1_amp,fx_air";
    for text in [
        format!("{padded}{ROWS}"),
        format!("{quoted}{ROWS}"),
        format!("{quoted}{all_quoted}"),
        format!("{NOD}{ROWS},,,,,\n,,,,,\n"),
        format!("sep=,\n{NOD},,,,,\n{ROWS}"),
        format!("{NOD}{}", ROWS.replace('\n', ",,\n")),
        format!(
            "{NOD}{}",
            ROWS.replace(",1\n", ",1.0\n")
                .replace(",0\n", ",FALSE\n")
                .replace(tall, "Time_ms,A1,A2,V1_Hz,V1_Amp,FX_air")
        ),
    ] {
        let again = cue(&text);
        assert_eq!(
            (again.title(), again.units(), again.interpolation()),
            (nod.title(), nod.units(), nod.interpolation()),
            "{text}"
        );
        assert_eq!((again.times(), again.positions()), (nod.times(), nod.positions()), "{text}");
        assert_eq!((again.tracks(), again.effects()), (nod.tracks(), nod.effects()), "{text}");
    }
}

#[test]
fn what_a_spreadsheet_adds_is_told_from_what_a_person_wrote() {
    assert_eq!(cue("# title: up, down,\ntime_ms,a1\n0,0\n1,0").title(), Some("up, down,"));
    assert_eq!(
        cue("# title: up, down,\ntime_ms,a1,a2\n0,0,0\n1,0,0").title(),
        Some("up, down"),
        "three cells"
    );
    assert_eq!(cue("\"# title: up, down,\"\ntime_ms,a1\n0,0\n1,0").title(), Some("up, down,"));
    assert!(faults("time_ms,a1\n0,0\n1,0,,7\n2,0").starts_with("3:5: the row has 4 cells, the header 2"));
    assert!(faults("time_ms,a1\n0,0\n\"# late\"\n1,0").starts_with("3:1: a comment among the rows"));
    assert!(
        faults("time_ms,a1\n0,0\n\"1,000\",1\n")
            .contains("write 1.000, or 1000 if the comma parts thousands")
    );
}

#[test]
fn a_comment_that_is_nearly_a_declaration_is_a_fault_with_the_line_to_write() {
    assert_eq!(
        faults("# kinocue-csv: 1\n# unit: mm\n# interpolation = monotone,,,\ntime_ms,a1\n0,0\n1,0.9"),
        "2:1: \"# unit: mm\" declares nothing; write \"# units: mm\"\n\
         3:1: \"# interpolation = monotone\" declares nothing; write \"# interpolation: monotone\""
    );
    assert!(
        faults("# unit: inch\ntime_ms,a1\n0,0\n1,0.9")
            .contains("write \"# units: \" and which; units are fraction")
    );
    // A sentence about what is declared is one; a second value for it is not.
    assert_eq!(cue("# units are mm\n# units: mm\ntime_ms,a1\n0,0\n1,0").units().of(0), Unit::Millimetre);
    assert!(faults("# units: mm\n# unit = deg\ntime_ms,a1\n0,0\n1,0").starts_with("2:1: \"# unit = deg\""));
}

#[test]
fn comments_stand_before_the_header_only() {
    assert!(faults("time_ms,a1\n0,0\n# units: mm\n1,0").starts_with("3:1: a comment among the rows"));
}

#[test]
fn text_that_is_none_is_refused() {
    assert_eq!(
        faults(b"time_ms,a1\n0,0\n1,\xff\n2,5"),
        "3:3: not UTF-8 text; save it as UTF-8\n4:3: a1: 5 is outside the stroke, 0 to 1"
    );
    assert_eq!(
        faults("time_ms,a1\r0,0\r1,0\r"),
        "1:11: a carriage return within a line; lines end in LF or CRLF"
    );
    assert_eq!(faults("time_ms,a1\n0,0\n1,\"0\n"), "3:3: a quote that is not closed in its line");
    let long = format!("time_ms,a1\n0,0\n1,{}\n2,7\n", "0".repeat(70_000));
    assert_eq!(faults(long), "3:1: longer than 65536 bytes, the limit");
}

#[test]
fn twenty_faults_are_told_and_the_rest_counted() {
    let rows: String = (1..=25).map(|ms| format!("{ms},9\n")).collect();
    let text = faults(format!("time_ms,a1\n0,0\n{rows}"));
    assert_eq!(text.lines().count(), 21);
    assert_eq!(text.lines().last(), Some(" and 5 more"));
}

#[test]
fn too_many_rows_are_refused_where_the_limit_is_met() {
    let endless = "time_ms,a1\n0,0\n1,0\n2,0\n".as_bytes().chain(std::io::repeat(b'x'));
    let faults = read_at_most(2, Path::new("t.csv"), endless).unwrap_err();
    assert_eq!(faults.to_string(), "t.csv:4:1: more than 8000000 rows, the limit of a cue");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nothing_from_outside_panics(bytes in proptest::collection::vec(any::<u8>(), 0..2048)) {
        let _ = read(Path::new("t.csv"), bytes.as_slice());
    }

    #[test]
    fn nothing_that_looks_like_a_cue_panics(
        lines in proptest::collection::vec("[-0-9.e,\"#: \r_a-z]{0,30}", 0..20),
        header in "time_(ms|s)(,a[0-9]{1,2}|,v[12]_(hz|amp)|,fx_[a-z]|,io|,\"){0,6}",
    ) {
        let text = format!("{header}\n{}", lines.join("\n"));
        let _ = read(Path::new("t.csv"), text.as_bytes());
    }
}

#[test]
fn each_axis_may_have_a_unit_of_its_own_and_degrees_go_below_0() {
    let rows = "time_s,a1,a2,v2_hz,v2_amp\n0,0,-180,20,0.5\n1,75,90,0,0\n";
    let cue = read(Path::new("t.csv"), format!("# units: mm, deg\n{rows}").as_bytes()).unwrap();
    assert_eq!((cue.units().of(0), cue.units().of(1)), (Unit::Millimetre, Unit::Degree));
    assert_eq!((cue.positions(), cue.unit_words().as_str()), (&[0.0, -180.0, 75.0, 90.0][..], "mm, deg"));
    let mut text = Vec::new();
    super::super::csv_write::write(&cue, &mut text).unwrap();
    let again = read(Path::new("t.csv"), &text[..]).unwrap();
    assert_eq!((again.units(), again.positions()), (cue.units(), cue.positions()));
}

#[test]
fn units_that_are_neither_one_nor_one_for_each_axis_are_refused_where_they_stand() {
    let fault = |units: &str| {
        let text = format!("# units: {units}\ntime_s,a1,a2,a3\n0,0,0,0\n1,0,0,0\n");
        read(Path::new("t.csv"), text.as_bytes()).unwrap_err().to_string()
    };
    let text = fault("mm, deg");
    assert!(text.starts_with("t.csv:1:10: units: ") && text.contains("or one for each of the 3"), "{text}");
    assert!(fault("mm, inch, mm").contains("units are fraction, percent, u8, mm, deg or pulse"));
}
