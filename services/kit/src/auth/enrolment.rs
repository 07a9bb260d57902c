//! Codes that kiosks trade for their tokens: of one use, for ten minutes, typed by people.
//!
//! The token is signed when the code is drawn, so that the issuer's key stays where it is. It waits in a folder that the
//! compositor reads, in a file of mode 0600 whose name is the code's digest. Removing the file is the trade: the system
//! lets one caller remove it, and a restart forgets nothing.

use super::issuer::create_secret;
use super::keys::{self, KeyFault};
use super::unix_s;
use crate::connections::Seat;
use crate::peer_budget::{Allowance, PeerBudget};
use sha2::{Digest, Sha256};
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use subtle::ConstantTimeEq;

/// Life of a code.
pub const LIFE: Duration = Duration::from_secs(600);
/// Characters of a code, 5 bits each: at twelve, guessing is hopeless even without a limit (2⁶⁰).
const LENGTH: usize = 12;
/// Crockford's base 32: no I, L, O, U.
const ALPHABET: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";
/// Wrong codes that a peer may send, beside the first one of each connection: people mistype.
const ALLOWANCE: Allowance = Allowance {
    burst: 10.0,
    per_second: 0.1,
};

/// Reason for which no code is traded.
#[derive(Debug, thiserror::Error)]
pub enum EnrolFault {
    /// It is unknown, used or too old.
    #[error("the code is unknown, used or older than ten minutes")]
    Code,
    /// The peer has guessed too often.
    #[error("too many wrong codes from this address")]
    Spent,
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] std::io::Error),
    /// The system has no random bytes.
    #[error(transparent)]
    Random(#[from] KeyFault),
}

/// Caller with a code: its address and its connection.
#[derive(Clone)]
pub struct Caller {
    peer: IpAddr,
    seat: Option<Arc<Seat>>,
}

impl Caller {
    /// Caller of a request.
    pub fn of<T>(request: &tonic::Request<T>) -> Self {
        let peer = request.remote_addr();
        Self {
            peer: peer.map_or(Ipv4Addr::UNSPECIFIED.into(), |a| a.ip()),
            seat: request.extensions().get().cloned(),
        }
    }

    /// No proof on its connection has failed.
    fn is_clean(&self) -> bool {
        self.seat.as_ref().is_some_and(|s| s.is_clean())
    }
}

/// Codes that wait in a folder.
pub struct Enrolments {
    folder: PathBuf,
    failures: PeerBudget,
}

impl Enrolments {
    /// Codes of a folder.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.into(),
            failures: PeerBudget::new(ALLOWANCE),
        }
    }

    /// Draws a code for a token; `XXXX-XXXX-XXXX`. Removes those that are too old.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn offer(&self, token: &str) -> Result<String, EnrolFault> {
        std::fs::create_dir_all(&self.folder)?;
        self.sweep()?;
        let drawn: [u8; LENGTH] = keys::random()?;
        let code: Vec<u8> = drawn
            .iter()
            .map(|b| ALPHABET[usize::from(b % 32)])
            .collect();
        let code = String::from_utf8_lossy(&code).into_owned();
        let text = format!("{}\n{token}\n", unix_s() + LIFE.as_secs());
        create_secret(&self.folder.join(digest(&code)), &text)?;
        let (a, rest) = code.split_at(4);
        let (b, c) = rest.split_at(4);
        Ok(format!("{a}-{b}-{c}"))
    }

    /// Trades a code for its token, once. The first code of a connection is always looked up, so that nobody behind the
    /// same address can spend a caller's attempts; wrong ones count for the connection and for the address.
    ///
    /// # Errors
    /// When there is no such code, or the caller has guessed too often.
    pub fn redeem(&self, code: &str, caller: &Caller) -> Result<String, EnrolFault> {
        if !caller.is_clean() && self.failures.is_spent(caller.peer, Instant::now()) {
            return Err(EnrolFault::Spent);
        }
        let token = self.take(&digest(&normalised(code)));
        if token.is_err() {
            self.failures.take(caller.peer, Instant::now());
            caller.seat.iter().for_each(|s| s.fail_proof());
        }
        token
    }

    fn take(&self, digest: &str) -> Result<String, EnrolFault> {
        let mut found = None;
        let waiting = match std::fs::read_dir(&self.folder) {
            // The first code makes the folder.
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Err(EnrolFault::Code),
            waiting => waiting?,
        };
        for entry in waiting {
            let entry = entry?;
            // Every name is compared, each in constant time.
            let name = entry.file_name();
            if bool::from(name.as_encoded_bytes().ct_eq(digest.as_bytes())) {
                found = Some(entry.path());
            }
        }
        let file = found.ok_or(EnrolFault::Code)?;
        let text = std::fs::read_to_string(&file).map_err(|_| EnrolFault::Code)?;
        // Of two at once, one removes the file.
        std::fs::remove_file(&file).map_err(|_| EnrolFault::Code)?;
        let (end, token) = text.split_once('\n').ok_or(EnrolFault::Code)?;
        let is_alive = end.parse::<u64>().is_ok_and(|end| unix_s() < end);
        if is_alive {
            Ok(token.trim().to_owned())
        } else {
            Err(EnrolFault::Code)
        }
    }

    fn sweep(&self) -> std::io::Result<()> {
        for entry in std::fs::read_dir(&self.folder)? {
            let entry = entry?;
            let modified = entry.metadata()?.modified()?;
            let is_code = entry.file_name().len() == 2 * size_of::<[u8; 32]>();
            if is_code && modified.elapsed().is_ok_and(|age| age > LIFE) {
                std::fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }
}

/// As people type it: any case, with or without dashes and spaces, O for 0, I and L for 1.
fn normalised(code: &str) -> String {
    let typed = code.chars().filter(|c| !c.is_whitespace() && *c != '-');
    typed
        .take(LENGTH + 1)
        .map(|c| match c.to_ascii_uppercase() {
            'O' => '0',
            'I' | 'L' => '1',
            c => c,
        })
        .collect()
}

/// Name of a code's file: SHA-256, hexadecimal.
fn digest(code: &str) -> String {
    let hash = Sha256::digest(code);
    hash.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A caller on that connection.
    fn caller(address: [u8; 4], seat: Option<Arc<Seat>>) -> Caller {
        Caller {
            peer: address.into(),
            seat,
        }
    }

    /// A caller on no connection.
    fn nobody() -> Caller {
        caller([127, 0, 0, 1], None)
    }

    #[test]
    fn a_code_is_traded_once_however_it_is_typed() {
        let dir = tempfile::tempdir().expect("a folder");
        let codes = Enrolments::new(&dir.path().join("codes"));
        let code = codes.offer("a.b.c").expect("drawn");
        assert_eq!(code.len(), LENGTH + 2);
        let typed = code.to_lowercase().replace('-', " ").replace('0', "o");
        assert_eq!(codes.redeem(&typed, &nobody()).expect("traded"), "a.b.c");
        assert!(matches!(
            codes.redeem(&code, &nobody()),
            Err(EnrolFault::Code)
        ));
    }

    #[test]
    fn no_name_holds_a_code_and_old_ones_are_void() {
        let dir = tempfile::tempdir().expect("a folder");
        let codes = Enrolments::new(dir.path());
        let code = codes.offer("a.b.c").expect("drawn");
        let file = std::fs::read_dir(dir.path()).expect("there").next();
        let file = file.expect("one").expect("readable").path();
        assert!(!file.to_string_lossy().contains(&code[..4]));
        std::fs::write(&file, format!("{}\na.b.c\n", unix_s() - 1)).expect("written");
        assert!(matches!(
            codes.redeem(&code, &nobody()),
            Err(EnrolFault::Code)
        ));
        assert!(!file.exists());
    }

    #[test]
    fn guessing_ends_soon_and_others_are_let_in() {
        let dir = tempfile::tempdir().expect("a folder");
        let codes = Enrolments::new(dir.path());
        let code = codes.offer("a.b.c").expect("drawn");
        for guess in ["", "0000-0000-0000", "../../etc/passwd", "ÄÖÜ"] {
            assert!(matches!(
                codes.redeem(guess, &nobody()),
                Err(EnrolFault::Code)
            ));
        }
        while !matches!(codes.redeem("0", &nobody()), Err(EnrolFault::Spent)) {}
        assert!(matches!(
            codes.redeem(&code, &nobody()),
            Err(EnrolFault::Spent)
        ));
        let other = caller([10, 0, 0, 1], None);
        assert!(codes.redeem(&code, &other).is_ok());
    }

    #[test]
    fn guesses_of_an_address_leave_its_new_connections_alone() {
        let dir = tempfile::tempdir().expect("a folder");
        let codes = Enrolments::new(dir.path());
        let code = codes.offer("a.b.c").expect("drawn");
        let guesser = caller([10, 0, 0, 1], Some(Seat::alone()));
        while !matches!(codes.redeem("0", &guesser), Err(EnrolFault::Spent)) {}
        assert!(matches!(
            codes.redeem(&code, &guesser),
            Err(EnrolFault::Spent)
        ));
        let kiosk = caller([10, 0, 0, 1], Some(Seat::alone()));
        assert!(matches!(codes.redeem("1", &kiosk), Err(EnrolFault::Code)));
        assert!(matches!(
            codes.redeem(&code, &kiosk),
            Err(EnrolFault::Spent)
        ));
        let other = caller([10, 0, 0, 1], Some(Seat::alone()));
        assert_eq!(codes.redeem(&code, &other).expect("traded"), "a.b.c");
    }

    #[test]
    fn guesses_end_their_connection() {
        let dir = tempfile::tempdir().expect("a folder");
        let codes = Enrolments::new(dir.path());
        let seat = Seat::alone();
        // An address each, so that none is spent.
        for i in 0..20 {
            let caller = caller([10, 0, 0, i], Some(seat.clone()));
            assert!(matches!(codes.redeem("0", &caller), Err(EnrolFault::Code)));
        }
        assert!(seat.is_ended());
    }
}
