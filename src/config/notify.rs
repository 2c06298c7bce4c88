//! `[notify]`: who is told of alarms, by a web hook or by mail; without the table nobody is.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::fault::Faults;
use super::section::{Entry, Section};

/// The mailer where none is named: what every mail system of Unix brings along.
const MAILER: &str = "/usr/sbin/sendmail";
/// What it is told: whom the mail is for stands in it, and a line with a point does not end it.
const MAILER_ARGS: [&str; 2] = ["-t", "-i"];
/// From one message to the next, seconds.
const EVERY_S: u32 = 60;

/// Who is told of alarms.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Notify {
    /// True if warnings are told, too, and not errors alone.
    pub(crate) has_warnings: bool,
    /// From one message to the next; what happens meanwhile is in the next.
    pub(crate) every: Duration,
    /// Where they are posted, if anywhere.
    pub(crate) webhook: Option<WebHook>,
    /// Who gets mail, if anybody.
    pub(crate) mail: Option<Mail>,
}

/// Where alarms are posted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WebHook {
    /// Host and port, to connect to.
    pub(crate) authority: String,
    /// Path and query.
    pub(crate) path: String,
}

/// Who gets mail, and what brings it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mail {
    pub(crate) to: Vec<String>,
    pub(crate) from: Option<String>,
    /// It gets the mail on its standard input.
    pub(crate) program: PathBuf,
    pub(crate) args: Vec<String>,
}

/// Reads the table.
pub(super) fn notify(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Notify> {
    let mut section = Section::new("[notify]", entry.at, entry.table(faults)?, faults);
    let has_warnings = section.choice("severity", &[("error", false), ("warning", true)]).unwrap_or(false);
    let every = section.whole_in("every_s", 1..=3_600).unwrap_or(EVERY_S);
    let webhook = section.get("webhook");
    let mail = section.get("mail");
    if webhook.is_none() && mail.is_none() {
        section.faults.note(entry.at, "[notify] tells nobody; add [notify.webhook] or [notify.mail]");
    }
    section.finish();
    let webhook = webhook.and_then(|entry| hook(entry, faults));
    let mail = mail.and_then(|entry| self::mail(entry, faults));
    Some(Notify { has_warnings, every: Duration::from_secs(every.into()), webhook, mail })
}

fn hook(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<WebHook> {
    let mut section = Section::new("[notify.webhook]", entry.at, entry.table(faults)?, faults);
    section.require(&["url"]);
    let entry = section.get("url");
    section.finish();
    let entry = entry?;
    let text = entry.text(faults)?;
    let uri: Option<hyper::Uri> = text.parse().ok();
    let authority =
        uri.as_ref().and_then(|uri| uri.authority()).filter(|authority| !authority.as_str().contains('@'));
    let hook = uri.as_ref().zip(authority).filter(|(uri, _)| uri.scheme_str() == Some("http"));
    let Some((uri, authority)) = hook else {
        let message = format!(
            "{text:?} is not an address such as \"http://10.0.0.9:8080/kinocue\"; https is not spoken here: for that name a relay in your \
             network that speaks it, or use [notify.mail]"
        );
        entry.fault(faults, &message);
        return None;
    };
    let port = authority.port_u16().unwrap_or(80);
    let path = uri.path_and_query().map_or("/", |path| path.as_str()).to_owned();
    Some(WebHook { authority: format!("{}:{port}", authority.host()), path })
}

fn mail(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Mail> {
    let mut section = Section::new("[notify.mail]", entry.at, entry.table(faults)?, faults);
    section.require(&["to"]);
    let to = section.get("to").and_then(|entry| {
        let all = entry.array(section.faults)?;
        if all.is_empty() {
            entry.fault(section.faults, "is empty; list who gets the mail");
        }
        Some(all.into_iter().filter_map(|entry| address(entry, section.faults)).collect())
    });
    let from = section.get("from").and_then(|entry| address(entry, section.faults));
    let program =
        section.get("program").map_or_else(|| Some(MAILER.into()), |entry| program(entry, section.faults));
    let args = section.get("args").map_or_else(
        || Some(MAILER_ARGS.map(str::to_owned).to_vec()),
        |entry| {
            let all = entry.array(section.faults)?;
            Some(all.into_iter().filter_map(|entry| entry.text(section.faults).map(str::to_owned)).collect())
        },
    );
    section.finish();
    Some(Mail { to: to?, from, program: program?, args: args? })
}

/// The address of a mailbox, as it goes into a header.
fn address(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<String> {
    let text = entry.text(faults)?;
    let is_part = |part: &str| {
        !part.is_empty() && part.chars().all(|one| one.is_ascii_graphic() && !"<>,;:\"()[]\\".contains(one))
    };
    // A mail system knows its own users without a host.
    let is_address = match text.split_once('@') {
        Some((user, host)) => is_part(user) && is_part(host) && !host.contains('@'),
        None => is_part(text),
    };
    if !is_address || text.starts_with('-') {
        entry.fault(faults, &format!("{text:?} is not an address such as \"technician@example.org\""));
        return None;
    }
    Some(text.to_owned())
}

fn program(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<PathBuf> {
    let text = entry.text(faults)?;
    if !Path::new(text).is_absolute() {
        entry.fault(
            faults,
            &format!("{text:?} is not the path of a program, such as \"{MAILER}\"; arguments go into args"),
        );
        return None;
    }
    Some(text.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn alarms_are_posted_or_mailed_or_both_and_the_usual_mailer_is_known() {
        assert_eq!(hall_with("").notify, None);
        let hall = hall_with(
            "[notify]\nseverity = \"warning\"\nevery_s = 5\n[notify.webhook]\nurl = \"http://10.0.0.9/hook?hall=1\"\n[notify.mail]\nto = \
             [\"root\", \"t@example.org\"]\n",
        );
        let notify = hall.notify.unwrap();
        assert_eq!((notify.has_warnings, notify.every), (true, Duration::from_secs(5)));
        let hook = notify.webhook.unwrap();
        assert_eq!((hook.authority.as_str(), hook.path.as_str()), ("10.0.0.9:80", "/hook?hall=1"));
        let mail = notify.mail.unwrap();
        assert_eq!(
            (mail.program.as_path(), mail.args),
            (Path::new(MAILER), vec!["-t".to_owned(), "-i".to_owned()])
        );
        let hall = hall_with("[notify.webhook]\nurl = \"http://[fd00::9]:8080\"\n");
        let notify = hall.notify.unwrap();
        assert_eq!((notify.has_warnings, notify.every), (false, Duration::from_secs(60)));
        assert_eq!(notify.webhook.unwrap().authority, "[fd00::9]:8080");
    }

    #[test]
    fn what_tells_nobody_or_would_be_another_command_is_refused() {
        let wrong = [
            ("[notify]", "[notify] tells nobody"),
            ("[notify.webhook]", "[notify.webhook] has no url"),
            ("[notify.webhook]\nurl = \"https://example.org/x\"", "https is not spoken here"),
            ("[notify.webhook]\nurl = \"http://user:secret@example.org/\"", "is not an address such as"),
            ("[notify.webhook]\nurl = \"10.0.0.9\"", "is not an address such as"),
            ("[notify.mail]\nto = []", "to: is empty"),
            ("[notify.mail]\nto = [\"a, b@example.org\"]", "is not an address such as"),
            ("[notify.mail]\nto = [\"-oQ/tmp\"]", "is not an address such as"),
            ("[notify.mail]\nto = [\"a\"]\nfrom = \"Hall <h@x>\"", "is not an address such as"),
            ("[notify.mail]\nto = [\"a\"]\nprogram = \"sendmail -t\"", "arguments go into args"),
            ("[notify.mail]\nto = [\"a\"]\nshell = true", "shell: unknown key in [notify.mail]"),
            (
                "[notify]\nseverity = \"info\"\n[notify.mail]\nto = [\"a\"]",
                "\"info\" is not one of error, warning",
            ),
        ];
        for (text, says) in wrong {
            let faults = faults_of(&format!("{text}\n"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
    }
}
