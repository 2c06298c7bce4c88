//! `kinocue completions`.

use clap::CommandFactory as _;
use clap_complete::Shell;

use super::{Cli, Exit, Failure, print};

/// Prints shell completions.
///
/// In bash, zsh and fish they know the cues, playlists, seats, presets and effects of the running service.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kinocue completions bash > ~/.local/share/bash-completion/completions/kinocue"
)]
pub(super) struct Args {
    /// The shell.
    shell: Shell,
}

/// Which names follow a command.
const NAMED: [(&str, &str); 6] = [
    ("load", "cues"),
    ("playlist", "playlists"),
    ("enable", "seats"),
    ("disable", "seats"),
    ("preset", "presets"),
    ("effects", "effects"),
];

/// Of bash: what the service knows takes the place of what the script has, unless an option is typed.
const BASH: &str = r#"
_kinocue_known() {
    _kinocue "$@"
    local kind= current="${COMP_WORDS[COMP_CWORD]}"
    case "${COMP_WORDS[1]}" in
CASES    esac
    # on or off comes before effects.
    [[ $kind == effects && $COMP_CWORD -lt 3 ]] && return
    if [[ -n $kind && $current != -* && $COMP_CWORD -ge 2 ]]; then
        COMPREPLY=($(compgen -W "$(kinocue known "$kind" 2>/dev/null)" -- "$current"))
    fi
}
complete -F _kinocue_known -o nosort -o bashdefault -o default kinocue
"#;

/// Of zsh.
const ZSH: &str = r#"
_kinocue_known() {
    local -a names
    names=("${(@f)$(kinocue known $1 2>/dev/null)}")
    compadd -a names
}
"#;

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    print::data(&script(args.shell))?;
    Ok(Exit::Done)
}

fn script(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "kinocue", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    match shell {
        Shell::Bash => {
            let case = |(command, kind): (&str, &str)| format!("        {command}) kind={kind} ;;\n");
            let cases: String = NAMED.into_iter().map(case).collect();
            script + &BASH.replace("CASES", &cases)
        }
        Shell::Fish => {
            let line = |(command, kind): (&str, &str)| {
                format!(
                    "complete -c kinocue -n \"__fish_seen_subcommand_from {command}\" -f -a \"(kinocue known {kind} 2>/dev/null)\"\n"
                )
            };
            script + &NAMED.into_iter().map(line).collect::<String>()
        }
        Shell::Zsh => zsh(&script),
        _ => script,
    }
}

/// The script of zsh, whose lines for these commands ask the service where they asked nobody.
fn zsh(script: &str) -> String {
    let (mut kind, mut text) = (None, String::new());
    for line in script.lines() {
        if let Some(command) = line.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
            kind = NAMED.into_iter().find(|(name, _)| *name == command).map(|(_, kind)| kind);
        }
        let is_argument = line.starts_with("':") || line.starts_with("'::") || line.starts_with("'*::");
        match kind.filter(|_| is_argument && line.contains(":_default'")) {
            Some(kind) => text += &line.replace(":_default'", &format!(":{{_kinocue_known {kind}}}'")),
            None => text += line,
        }
        text.push('\n');
    }
    // Ahead of what calls it.
    match text.split_once("\n_kinocue() {") {
        Some((before, after)) => format!("{before}{ZSH}\n_kinocue() {{{after}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_ask_the_service_for_the_names_of_each_kind() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let script = script(shell);
            for (command, kind) in NAMED {
                let asks = match shell {
                    Shell::Bash => format!("{command}) kind={kind} ;;"),
                    Shell::Zsh => format!("{{_kinocue_known {kind}}}'"),
                    _ => format!("from {command}\" -f -a \"(kinocue known {kind} 2>/dev/null)\""),
                };
                assert!(script.contains(&asks), "{shell} {command}: {asks}");
            }
        }
        let zsh = script(Shell::Zsh);
        assert!(
            zsh.starts_with("#compdef kinocue") && zsh.contains("\n_kinocue_known() {"),
            "{}",
            &zsh[..200]
        );
    }
}
