//! Alarms by mail, by the mailer of the system: a program with fixed arguments, without a shell, that gets the mail on its standard input.

use std::fmt::Write as _;
use std::io::{Read as _, Write as _};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::Duration;

use rustix::fs::{OFlags, fcntl_setfl};

use super::outbox::{Alarm, AlarmMessage, AlarmTurn};
use crate::config::Mail;
use crate::plain;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// How long the mailer may take; one that takes longer is ended.
const PATIENCE: Duration = Duration::from_secs(30);
/// From one look whether it has ended to the next.
const LOOK: Duration = Duration::from_millis(50);
/// The longest mail, bytes: a pipe holds it, so that nobody waits for a mailer that does not read.
const LONGEST: usize = 32 << 10;
/// Of a line so much is told, bytes; and of what the mailer says.
const LINE: usize = 900;
const SAID: usize = 300;

/// Mails a message.
///
/// # Errors
/// Why it is not on its way, with what to do.
pub(super) fn send(mail: &Mail, message: &AlarmMessage) -> Result<(), String> {
    let program = plain::path(&mail.program);
    let failed = |why: &dyn std::fmt::Display| {
        format!("{program}: {why}; check [notify.mail], and try the program by hand")
    };
    let mut command = Command::new(&mail.program);
    command.args(&mail.args).env_clear().env("PATH", "/usr/sbin:/usr/bin:/sbin:/bin");
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| failed(&error))?;
    // One that ended already says by its end why.
    let _ = child.stdin.take().map(|mut stdin| stdin.write_all(text(mail, message).as_bytes()));
    let ended = ends(&mut child).map_err(|error| failed(&error))?;
    match ended {
        Some(status) if status.success() => Ok(()),
        Some(status) => {
            let said = child.stderr.take().map(said).unwrap_or_default();
            Err(failed(&format_args!("it ended with {status}: {}", plain::escaped(said.trim(), SAID))))
        }
        None => Err(failed(&format_args!("it took longer than {} s, and was ended", PATIENCE.as_secs()))),
    }
}

/// What a mailer said that has ended. What it started may still run, and is not waited for.
fn said(mut stderr: ChildStderr) -> String {
    let mut octets = [0; SAID];
    let read = fcntl_setfl(&stderr, OFlags::NONBLOCK).is_ok().then(|| stderr.read(&mut octets).unwrap_or(0));
    String::from_utf8_lossy(&octets[..read.unwrap_or(0)]).into_owned()
}

/// Waits for the end of a mailer; `None` where that did not come, and it was ended.
fn ends(child: &mut Child) -> std::io::Result<Option<std::process::ExitStatus>> {
    let mut at = Monotonic.now();
    let until = at + PATIENCE;
    while at < until {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        at = at + LOOK;
        Monotonic.sleep_until(at);
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}

/// The mail: its head, and a paragraph for each alarm.
fn text(mail: &Mail, message: &AlarmMessage) -> String {
    let AlarmMessage { hall, alarms, omitted, .. } = message;
    let count = |turn| alarms.iter().filter(|alarm| alarm.what == turn).count();
    // A head is of ASCII; how a hall is called that is not stands in the mail.
    let whose = if hall.is_ascii() { format!(" {}", plain::escaped(hall, 60)) } else { String::new() };
    let (raised, cleared) = (count(AlarmTurn::Raised), count(AlarmTurn::Cleared));
    let mut text = format!("To: {}\n", mail.to.join(",\n "));
    if let Some(from) = &mail.from {
        let _ = writeln!(text, "From: {from}"); // a String takes it
    }
    let _ = write!(
        text,
        "Subject: kinocue{whose}: {raised} raised, {cleared} cleared\nMIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\n\
         Content-Transfer-Encoding: 8bit\nAuto-Submitted: auto-generated\n\n{}\n",
        plain::escaped(hall, LINE)
    );
    let mut left = *omitted;
    for alarm in alarms {
        let paragraph = paragraph(alarm);
        if text.len() + paragraph.len() > LONGEST {
            left += 1;
        } else {
            text += &paragraph;
        }
    }
    if left > 0 {
        let _ = write!(text, "\nand {left} more: see the console, or `kinocue status`\n");
    }
    text
}

fn paragraph(alarm: &Alarm) -> String {
    let Alarm { what, severity, controller, text, remedy, at, .. } = alarm;
    let turn = match what {
        AlarmTurn::Raised => *severity,
        AlarmTurn::Cleared => "over",
    };
    let whose = controller.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    let line = |text: &str| plain::escaped(text, LINE).into_owned();
    let next = match what {
        AlarmTurn::Raised if !remedy.is_empty() => format!("  next: {}\n", line(remedy)),
        _ => String::new(),
    };
    format!("\n{at} {turn}: {}\n{next}", line(&format!("{whose}{text}")))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;
    use std::path::PathBuf;

    use super::super::outbox::{MOST, alarm};
    use super::*;

    /// A mailer that does that.
    fn mailer(folder: &tempfile::TempDir, does: &str) -> Mail {
        let program = folder.path().join("mailer");
        // A file that is still open for writing in another thread's child cannot be run, so a shell reads it.
        fs::write(&program, does).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        Mail {
            to: vec!["root".to_owned(), "t@example.org".to_owned()],
            from: Some("hall@example.org".to_owned()),
            program: PathBuf::from("/bin/sh"),
            args: [program.to_str().unwrap(), "-t", "-i"].map(str::to_owned).to_vec(),
        }
    }

    fn message(alarms: Vec<Alarm>) -> AlarmMessage {
        AlarmMessage { hall: "Hall 1".to_owned(), message: "m-1".to_owned(), alarms, omitted: 0 }
    }

    #[test]
    fn a_mailer_gets_a_mail_on_its_input_and_its_arguments_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let mail = mailer(&folder, &format!("echo \"$@\" > {0}; cat >> {0}\n", out.display()));
        let over = Alarm { what: AlarmTurn::Cleared, ..alarm("A1 is silent") };
        send(&mail, &message(vec![alarm("A1 is silent"), over])).unwrap();
        let got = fs::read_to_string(out).unwrap();
        let (head, body) = got.split_once("\n\n").unwrap();
        assert!(head.starts_with("-t -i\nTo: root,\n t@example.org\nFrom: hall@example.org\nSubject: kinocue Hall 1: 1 raised, 1 cleared\n"), "{head}");
        assert!(body.contains("error: A1: A1 is silent\n  next: look\n"), "{body}");
        assert!(body.contains("over: A1: A1 is silent\n"), "{body}");
    }

    #[test]
    fn no_name_and_no_text_makes_a_head_or_a_line_of_its_own() {
        let mail = mailer(&tempfile::tempdir().unwrap(), "");
        let evil = "x\nBcc: a@b\r\n.\n\u{202e}";
        let mut message = message(vec![Alarm { controller: Some(evil.to_owned()), ..alarm(evil) }]);
        message.hall = format!("Saal\nBcc: {evil}");
        let text = text(&mail, &message);
        assert!(text.lines().all(|line| !line.starts_with("Bcc") && line != "."), "{text}");
        assert!(!text.contains('\r') && !text.contains('\u{202e}'), "{text}");
        assert!(text.lines().all(|line| line.len() < 998), "as long as lines of mail may be");
    }

    #[test]
    fn the_longest_mail_fits_a_pipe_and_says_what_is_left_out() {
        let mail = mailer(&tempfile::tempdir().unwrap(), "");
        let mut message = message(vec![alarm(&"x".repeat(5_000)); MOST]);
        message.omitted = 7;
        let text = text(&mail, &message);
        assert!(text.len() < 33 << 10, "{}", text.len());
        let left: u64 = text.rsplit_once("and ").unwrap().1.split(' ').next().unwrap().parse().unwrap();
        assert!(left > 7 && left < 7 + MOST as u64, "{left}");
    }

    #[test]
    fn a_mailer_that_fails_or_is_not_there_is_told_with_its_words() {
        let folder = tempfile::tempdir().unwrap();
        let error =
            send(&mailer(&folder, "echo 'no such\tuser' >&2; exit 67\n"), &message(Vec::new())).unwrap_err();
        assert!(error.contains("exit status: 67: no such\\tuser; check [notify.mail]"), "{error}");
        // It reads nothing, and ends.
        assert!(send(&mailer(&folder, "exit 0\n"), &message(vec![alarm("x"); MOST])).is_ok());
        let mut none = mailer(&folder, "");
        none.program = folder.path().join("none");
        assert!(send(&none, &message(Vec::new())).unwrap_err().contains("No such file"));
    }
}
