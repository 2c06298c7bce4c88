//! `kinocue fleet init`: keys, the configuration of the engine with what each member may, and the settings of links and desk.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use nkeys::KeyPair;

use super::engine::inbox;
use super::made::{LETTERS, put, seed};
use super::migrate::migrate;
use super::settings::is_loopback;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::is_fleet_id;
use crate::fleet::{self, CUES, DOMAIN, HAVE, LOG, SEEN, WANT, new_letter_key};
use crate::journal::{self, new_journal_key};

/// Makes keys and configurations of a fleet in a new folder.
///
/// nats-server.conf is for the engine: it says what each member may, by its key. A folder for each hall has fleet.toml with its key, and what
/// goes into its kinocue.toml; one for the desk has desk.toml and its two keys: one logs in at the engine, the other signs orders. The
/// halls allow nothing yet but a stop. Nothing is installed or started. With --migrate, a desk of an earlier version gets the second key.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site of the halls.
    #[arg(long, value_name = "NAME", value_parser = name, required_unless_present = "migrate")]
    site: Option<String>,
    /// The halls.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', required_unless_present = "migrate", value_parser = name)]
    halls: Vec<String>,
    /// Those of them with two show machines: their keys may keep a lease at the engine.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = name)]
    pairs: Vec<String>,
    /// Who asks at the desk.
    #[arg(long, value_name = "NAME", value_parser = name, default_value = "office")]
    desk: String,
    /// Where the engine listens, and where the others find it.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:4222")]
    engine: String,
    /// The folder to be made.
    #[arg(long, value_name = "DIR", default_value = "fleet")]
    folder: PathBuf,
    /// Makes nothing but the key for letters of this desk, whose settings are of an earlier version, and prints what each hall needs.
    #[arg(long, value_name = "DESK.TOML", exclusive = true)]
    migrate: Option<PathBuf>,
}

/// What is made, and for whom.
pub(super) struct Plan<'a> {
    pub(super) site: &'a str,
    pub(super) halls: &'a [String],
    /// Those of them that keep a lease.
    pub(super) pairs: &'a [String],
    pub(super) desk: &'a str,
    /// `HOST:PORT`.
    pub(super) engine: &'a str,
    /// The folder in which the engine keeps its streams.
    pub(super) store: &'a str,
    /// What the halls allow.
    pub(super) allow: &'a str,
}

fn name(text: &str) -> Result<String, String> {
    match text {
        fleet::ALL => Err("all means every hall".to_owned()),
        text if is_fleet_id(text) => Ok(text.to_owned()),
        _ => Err("a name is made of a to z, 0 to 9, - and _".to_owned()),
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let Args { site, halls, pairs, desk, engine, folder, migrate: old } = args;
    if let Some(settings) = old {
        return migrate(settings);
    }
    let site = site.as_deref().unwrap_or_default(); // it is required beside the halls
    let plan = Plan { site, halls, pairs, desk, engine, store: "/var/lib/nats/jetstream", allow: "[]" };
    if let Some(nobody) = pairs.iter().find(|pair| !halls.contains(pair)) {
        let error = anyhow!("--pairs: {nobody} is none of --halls, {}", halls.join(", "));
        return Err(error).or_exit(Exit::Usage);
    }
    let is_alone = host(engine)?;
    if folder.exists() {
        let error = anyhow!("{} is there; keys are made once: give another --folder", folder.display());
        return Err(error).or_exit(Exit::Usage);
    }
    make(&plan, folder)?;
    print::out(&next_steps(&plan, folder, is_alone))?;
    Ok(Exit::Done)
}

/// True if an engine there is reached from this machine alone.
fn host(engine: &str) -> Result<bool, Failure> {
    let parts =
        engine.rsplit_once(':').filter(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    let why = || anyhow!("{engine:?} is no HOST:PORT, such as engine.example:4222");
    Ok(is_loopback(parts.ok_or_else(why).or_exit(Exit::Usage)?.0))
}

/// Makes all files.
pub(super) fn make(plan: &Plan<'_>, folder: &Path) -> Result<(), Failure> {
    let (desk, letters) = (KeyPair::new_user(), new_letter_key());
    let halls: Vec<_> = plan.halls.iter().map(|hall| (hall, KeyPair::new_user())).collect();
    let engine = engine_conf(plan, &desk, &halls)?;
    put(&folder.join("nats-server.conf"), &engine, 0o644)?;
    let scheme = if host(plan.engine)? { "nats" } else { "tls" };
    let access = |seed: &str| {
        let ca = if scheme == "tls" { "ca = \"fleet-ca.pem\"\n" } else { "" };
        format!("engine = [\"{scheme}://{}\"]\nseed = \"{seed}\"\n{ca}", plan.engine)
    };
    let mut journals =
        String::from("[journals]                     # who seals what halls tell of their shows\n");
    for (hall, pair) in &halls {
        let of_hall = folder.join(hall);
        put(&of_hall.join("fleet.nk"), &seed(pair)?, 0o600)?;
        let keys = journal_keys(&of_hall, plan.pairs.contains(hall))?;
        let _ = writeln!(journals, "\"{}.{hall}\" = [{keys}]", plan.site); // a String takes it
        let settings = format!("{}site = \"{}\"\nhall = \"{hall}\"\n", access("fleet.nk"), plan.site);
        put(&of_hall.join("fleet.toml"), &settings, 0o644)?;
        put(&of_hall.join("kinocue-fleet.toml"), &hall_table(plan, hall, &letters), 0o644)?;
    }
    let of_desk = folder.join(plan.desk);
    let names: Vec<_> = halls.iter().map(|(hall, _)| format!("\"{}.{hall}\"", plan.site)).collect();
    put(&of_desk.join("desk.nk"), &seed(&desk)?, 0o600)?;
    put(&of_desk.join(LETTERS), &seed(&letters)?, 0o600)?;
    let names = names.join(", ");
    // Which of them start together the site knows.
    let groups = format!(
        "\n# Halls that start together, as `kinocue fleet start --group house`:\n# [groups]\n# house = [{names}]\n"
    );
    let settings = format!(
        "{}letters = \"{LETTERS}\"\nname = \"{}\"\nhalls = [{names}]\n{groups}\n{journals}",
        access("desk.nk"),
        plan.desk
    );
    put(&of_desk.join("desk.toml"), &(settings + PAGE), 0o644)
}

/// Makes the key that seals the journal of a hall, or of each of its two machines; gives their public halves.
fn journal_keys(of_hall: &Path, is_pair: bool) -> Result<String, Failure> {
    let files = if is_pair {
        vec![journal::KEY.to_owned(), format!("second-{}", journal::KEY)]
    } else {
        vec![journal::KEY.to_owned()]
    };
    let mut keys = Vec::new();
    for file in files {
        let pair = new_journal_key();
        put(&of_hall.join(file), &seed(&pair)?, 0o600)?;
        keys.push(format!("\"{}\"", pair.public_key()));
    }
    Ok(keys.join(", "))
}

/// What the settings of a desk say of its page.
const PAGE: &str = "
# The page of all halls, `kinocue fleet desk`: where it is, and who may come. Take the # away.
#[api]
#listen = [\"127.0.0.1:8470\"]
#open_role = \"view\"            # whoever comes looks and stops; without it only who has a token ([[api.token]], `kinocue token`)
#[consoles]                     # links to the consoles of halls
#\"SITE.HALL\" = \"http://10.0.0.3:8480\"
";

/// The lines of a hall's own configuration.
fn hall_table(plan: &Plan<'_>, hall: &str, letters: &KeyPair) -> String {
    let (site, name, public) = (plan.site, plan.desk, letters.public_key());
    format!(
        "# Add this to kinocue.toml, and restart the service. A stop is always taken; name in allow what else the desk may ask:\n\
         # pause, park, disarm, load, levels, trim, preflight, cues and playlists, which come into its folders, and pull, which fetches its cues. With start = true it may also start\n\
         # what somebody here has armed with --fleet.\n\
         [fleet]\nname = \"{site}.{hall}\"\nallow = {}\n\n[[fleet.key]]\nname = \"{name}\"\nrole = \"operate\"\npublic = \"{public}\"\n",
        plan.allow
    )
}

/// The configuration of the engine. Everybody has a key, and may what is listed for it: nobody else is let in.
fn engine_conf(plan: &Plan<'_>, desk: &KeyPair, halls: &[(&String, KeyPair)]) -> Result<String, Failure> {
    let mut text =
        String::from("# Made by `kinocue fleet init`: what each member of the fleet may, by its key.\n");
    let listen = plan.engine.rsplit_once(':').map_or("4222", |(_, port)| port);
    let is_alone = host(plan.engine)?;
    let listen = if is_alone { plan.engine.to_owned() } else { format!("0.0.0.0:{listen}") };
    let tls = "tls { cert_file: \"/etc/nats/fleet-engine.pem\", key_file: \"/etc/nats/fleet-engine.key\" }\n";
    let _ = write!(
        text,
        "server_name: {}-engine\nlisten: \"{listen}\"\n{}ping_interval: \"5s\"\nping_max: 2\nmax_payload: 1048576\n\
         jetstream {{ store_dir: \"{}\", domain: {DOMAIN} }}\n\nauthorization {{\n  users: [\n",
        plan.site,
        if is_alone { "" } else { tls },
        plan.store
    ); // a String takes it
    user(&mut text, plan.desk, &desk.public_key(), &of_desk(plan.desk), false);
    for (hall, pair) in halls {
        let member = format!("{}.{hall}", plan.site);
        let mut rights = of_hall(plan.site, &member);
        if plan.pairs.contains(hall) {
            rights.publish.extend(of_pair(&member));
        }
        user(&mut text, &member, &pair.public_key(), &rights, true);
    }
    text.push_str("  ]\n}\n");
    Ok(text)
}

/// What somebody may publish and hear.
struct Rights {
    publish: Vec<String>,
    subscribe: Vec<String>,
}

/// A subject of the engine's own in both its forms: as members name it, also across a leaf node, and as the engine itself checks it.
fn api(what: &str) -> [String; 2] {
    let own = if what.starts_with('$') { what.to_owned() } else { format!("$JS.API.{what}") };
    [format!("$JS.{DOMAIN}.API.{what}"), own]
}

/// A desk asks under its own name, hears how halls are, wishes for halls, and has the engine keep what a fleet needs, which it reads.
fn of_desk(desk: &str) -> Rights {
    let [seen, want, have] = [SEEN, WANT, HAVE].map(|bucket| format!("KV_{bucket}"));
    let chunks = fleet::chunk_of("*", "*");
    let mut publish = vec![fleet::command_to("*.*", desk, "*"), fleet::stop_to("*.*", desk), chunks.clone()];
    publish.extend(api(&format!("$KV.{WANT}.*.*")));
    for stream in [LOG, CUES, &seen, &want, &have] {
        publish
            .extend(["INFO", "CREATE"].into_iter().flat_map(|what| api(&format!("STREAM.{what}.{stream}"))));
    }
    for (stream, subject) in [
        (&*seen, format!("$KV.{SEEN}.>")),
        (&*want, format!("$KV.{WANT}.>")),
        (&*have, format!("$KV.{HAVE}.>")),
        (CUES, chunks),
    ] {
        publish.extend(api(&format!("DIRECT.GET.{stream}.{subject}")));
    }
    for what in [format!("CREATE.{LOG}"), format!("CREATE.{LOG}.>"), format!("MSG.NEXT.{LOG}.>")] {
        publish.extend(api(&format!("CONSUMER.{what}")));
    }
    Rights { publish, subscribe: vec![fleet::status_of("*.*"), format!("{}.>", inbox(desk))] }
}

/// A hall tells of itself alone, hears what it alone is asked, answers whoever asked, and looks up what it alone shall have and the files
/// of that. Neither consumers nor DIRECT.GET of what it wrote itself: they send that on as it is, to wherever they are asked to.
fn of_hall(site: &str, member: &str) -> Rights {
    let mut publish = vec![fleet::status_of(member), fleet::log_of(member)];
    publish.extend(api(&format!("STREAM.MSG.GET.{LOG}")));
    publish.extend(api(&format!("DIRECT.GET.KV_{WANT}.$KV.{WANT}.{member}")));
    publish.extend(api(&format!("DIRECT.GET.{CUES}.{}", fleet::chunk_of("*", "*"))));
    publish.extend([SEEN, HAVE].iter().flat_map(|bucket| api(&format!("$KV.{bucket}.{member}"))));
    let all = fleet::stop_to(&format!("{site}.{}", fleet::ALL), "*");
    let inbox = format!("{}.>", inbox(member));
    let subscribe = vec![fleet::command_to(member, "*", "*"), fleet::stop_to(member, "*"), all, inbox];
    Rights { publish, subscribe }
}

/// What a hall of two show machines may beside that. It makes the stream of its lease, and the engine lets whoever makes a stream say of which
/// subjects: such a key could have the engine keep what others are asked, so none has it without need.
fn of_pair(member: &str) -> Vec<String> {
    let stream = fleet::lease_stream(member);
    let asks =
        ["INFO", "CREATE", "MSG.GET"].into_iter().flat_map(|what| api(&format!("STREAM.{what}.{stream}")));
    // Each machine tells its own journal.
    asks.chain([fleet::lease_of(member), fleet::log_of_machine(member, "*")]).collect()
}

fn user(text: &mut String, name: &str, public: &str, rights: &Rights, answers: bool) {
    let list = |subjects: &[String]| {
        let all: Vec<_> = subjects.iter().map(|subject| format!("\"{subject}\"")).collect();
        all.join(",\n        ")
    };
    // That a hall is at it, and what came of it.
    let answers = if answers { "      allow_responses: { max: 2, expires: \"90s\" }\n" } else { "" };
    let _ = write!(
        text,
        "    # {name}\n    {{ nkey: {public}, permissions: {{\n      publish: {{ allow: [\n        {}] }}\n      \
         subscribe: {{ allow: [\n        {}] }}\n{answers}    }} }}\n",
        list(&rights.publish),
        list(&rights.subscribe)
    );
}

/// What a person does with it.
fn next_steps(plan: &Plan<'_>, folder: &Path, is_alone: bool) -> String {
    let (folder, site) = (folder.display(), plan.site);
    let hall = plan.halls.first().map_or("h1", String::as_str);
    let mut text = format!(
        "made {folder}: keys of {} halls of {site} and of the desk {}\n\n\
         1. The engine: {folder}/nats-server.conf to its machine (Debian: nats-server), then nats-server -c nats-server.conf\n\
         2. Each hall, as {hall}: {folder}/{hall}/kinocue-fleet.toml into its kinocue.toml; fleet.toml and fleet.nk to /etc/kinocue;\n   \
         journal.nk to /var/lib/kinocue, of kinocue and of mode 0600; systemctl restart kinocue; systemctl enable --now kinocue-link\n\
         3. The desk: {folder}/{}/desk.toml, desk.nk and {LETTERS} to /etc/kinocue; kinocue fleet status\n",
        plan.halls.len(),
        plan.desk,
        plan.desk
    );
    if !is_alone {
        let host = plan.engine.rsplit_once(':').map_or(plan.engine, |(host, _)| host);
        let kind = if host.parse::<std::net::IpAddr>().is_ok() { "IP" } else { "DNS" };
        let _ = write!(
            text,
            "\nThe engine needs a certificate, since it is reached over a network; fleet-ca.pem goes beside each fleet.toml and desk.toml:\n\
             openssl req -x509 -newkey ed25519 -nodes -days 3650 -subj /CN=fleet-ca -keyout fleet-ca.key -out fleet-ca.pem\n\
             openssl req -newkey ed25519 -nodes -subj /CN={host} -keyout fleet-engine.key | openssl x509 -req -days 825 -CA fleet-ca.pem \
             -CAkey fleet-ca.key -CAcreateserial -extfile <(echo subjectAltName={kind}:{host}) -out fleet-engine.pem\n"
        );
    }
    text
}
