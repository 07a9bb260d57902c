//! Standard output that nobody reads any more: the process ends by SIGPIPE, as in `tryon doctor | head -1`.

use crate::args::{Command, TokenArgs, TokenWhat};

/// Lets SIGPIPE end this process, unless the command has connections: a write to a broken one raises it too (`writev` has no
/// MSG_NOSIGNAL). Such commands write with [`crate::say::say`].
pub(crate) fn end_when_closed(command: &Command) {
    #[cfg(unix)]
    if !has_connections(command) {
        use signal_hook::consts::SIGPIPE;
        use signal_hook::flag::register_conditional_default;
        let always = std::sync::Arc::new(true.into());
        // Without the handler a write fails, as Rust has it.
        let _ = register_conditional_default(SIGPIPE, always);
    }
}

/// Commands that serve, or call services.
fn has_connections(command: &Command) -> bool {
    match command {
        Command::Demo(_)
        | Command::Up(_)
        | Command::Fine(_)
        | Command::Record(_)
        | Command::Replay(_) => true,
        Command::Token(TokenArgs { what }) => matches!(what, TokenWhat::Redeem(_)),
        _ => false,
    }
}
