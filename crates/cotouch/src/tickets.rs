//! Tickets that programs of one account leave for each other on one computer, so that an address is enough there.
//!
//! A server's ticket is in a file of its own, in a folder that only this account can open, and locked for as long as the server
//! lives: a file without a lock is left over from one that died.

use std::fs::{DirBuilder, File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, ensure};
use cotouch_net::{Route, SessionKey, Ticket};

/// A ticket has at most so many bytes.
const MAX_TICKET_BYTES: u64 = 256;

/// A ticket that others on this computer find. Dropping it takes it away.
pub(crate) struct PostedTicket {
    file: File,
    path: PathBuf,
}

impl PostedTicket {
    /// Leaves the key of `ticket` for those who know its address.
    pub(crate) fn post(ticket: Ticket) -> anyhow::Result<Self> {
        let path = private_folder()?.join(file_name(ticket.address));
        let unfinished = path.with_extension(std::process::id().to_string());
        let place = || format!("the ticket cannot be written to {}", path.display());
        // Under its own name only when it is whole and locked.
        let mut file = new_private_file(&unfinished).with_context(place)?;
        file.lock().with_context(place)?;
        write!(file, "{}", ticket.key).with_context(place)?;
        std::fs::rename(&unfinished, &path).with_context(place)?;
        Ok(Self { file, path })
    }
}

impl Drop for PostedTicket {
    fn drop(&mut self) {
        let is_own = |found: &std::fs::Metadata| {
            self.file.metadata().is_ok_and(|own| (own.dev(), own.ino()) == (found.dev(), found.ino()))
        };
        if std::fs::metadata(&self.path).is_ok_and(|found| is_own(&found)) {
            // What is left over has no lock, and nobody heeds it.
            let _: std::io::Result<()> = std::fs::remove_file(&self.path);
        }
    }
}

/// The key to the session that this account serves at `address` on this computer, if there is one.
pub(crate) fn posted(address: Route) -> Option<SessionKey> {
    let folder = private_folder().ok()?;
    listening_at(address).into_iter().find_map(|address| read(&folder.join(file_name(address))))
}

/// Whether `address` is one of this computer.
pub(crate) fn is_here(address: Route) -> bool {
    address.socket_address().is_none_or(|address| UdpSocket::bind((address.ip(), 0)).is_ok())
}

/// The ticket with an address that others can reach: one that listens at all addresses of this computer says by which one it goes out.
pub(crate) fn for_others(ticket: Ticket) -> Ticket {
    let Some(address) = ticket.address.socket_address().filter(|address| address.ip().is_unspecified())
    else {
        return ticket;
    };
    let reached = outgoing_ip(address.ip()).unwrap_or(match address.ip() {
        IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
    });
    Ticket { address: SocketAddr::new(reached, address.port()).into(), ..ticket }
}

/// The address by which this computer goes out to the Internet. A socket that is connected asks the routing table and sends nothing.
fn outgoing_ip(any: IpAddr) -> Option<IpAddr> {
    // Addresses for documentation (RFC 5737, RFC 3849).
    let far: IpAddr = match any {
        IpAddr::V4(_) => Ipv4Addr::new(192, 0, 2, 1).into(),
        IpAddr::V6(_) => Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1).into(),
    };
    let socket = UdpSocket::bind((any, 0)).ok()?;
    socket.connect((far, 9)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}

/// Where a server listens that is reached at `address`: there, or at all addresses of this computer.
fn listening_at(address: Route) -> Vec<Route> {
    let anywhere = address.socket_address().filter(|_| is_here(address)).into_iter().flat_map(|address| {
        [IpAddr::from(Ipv4Addr::UNSPECIFIED), Ipv6Addr::UNSPECIFIED.into()]
            .map(|any| SocketAddr::new(any, address.port()).into())
    });
    std::iter::once(address).chain(anywhere).collect()
}

fn read(path: &Path) -> Option<SessionKey> {
    let file = File::open(path).ok()?;
    if !matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) {
        // Nobody holds it: its server has died.
        return None;
    }
    let mut text = String::new();
    file.take(MAX_TICKET_BYTES).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

fn file_name(address: Route) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    format!("{}-ticket", address.to_string().replace(':', "_").chars().map(plain).collect::<String>())
}

fn new_private_file(path: &Path) -> std::io::Result<File> {
    // What a process with the same number left behind is of no use to anybody.
    let _: std::io::Result<()> = std::fs::remove_file(path);
    OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)
}

/// A folder that belongs to this account and that nobody else can open, made if need be.
fn private_folder() -> anyhow::Result<PathBuf> {
    let user = rustix::process::getuid().as_raw();
    let folder = match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) if !folder.is_empty() => PathBuf::from(folder).join("cotouch"),
        _ => std::env::temp_dir().join(format!("cotouch-{user}")),
    };
    match DirBuilder::new().mode(0o700).create(&folder) {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
        made => made.with_context(|| format!("the folder {} cannot be made", folder.display()))?,
    }
    // Not through a link that somebody else made there.
    let found = std::fs::symlink_metadata(&folder)
        .with_context(|| format!("the folder {} cannot be looked at", folder.display()))?;
    ensure!(
        found.is_dir() && found.uid() == user && found.mode() & 0o077 == 0,
        "{} must be a folder of this account that nobody else can open",
        folder.display()
    );
    Ok(folder)
}

/// Asks `look` again and again until it finds something; for at most `patience`, and not for long after it is no longer `wanted`.
pub(crate) fn wait_for<T>(
    patience: Duration,
    wanted: impl Fn() -> bool,
    look: impl Fn() -> Option<T>,
) -> Option<T> {
    const PAUSE: Duration = Duration::from_millis(20);
    let mut left = patience;
    loop {
        let found = look();
        if found.is_some() || left.is_zero() || !wanted() {
            return found;
        }
        std::thread::sleep(PAUSE);
        left = left.saturating_sub(PAUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(seed: u8) -> SessionKey {
        cotouch_net::SecureNode::serve(Box::new(move |bytes: &mut [u8]| bytes.fill(seed))).session_key()
    }

    fn route(text: &str) -> Route {
        text.parse::<SocketAddr>().unwrap().into()
    }

    #[test]
    fn a_ticket_is_found_while_its_server_lives() {
        // Ports that no other test of this account listens at.
        let (address, elsewhere) = (route("127.0.0.1:1"), route("127.0.0.1:2"));
        let posted_ticket = PostedTicket::post(Ticket { address, key: key(1) }).unwrap();
        assert_eq!((posted(address), posted(elsewhere)), (Some(key(1)), None));
        // A server started anew takes its place, and the old one's end does not take that away.
        let newer = PostedTicket::post(Ticket { address, key: key(2) }).unwrap();
        drop(posted_ticket);
        assert_eq!(posted(address), Some(key(2)));
        let path = newer.path.clone();
        assert_eq!(std::fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        drop(newer);
        assert!(!path.exists() && posted(address).is_none());
        // What a server that was killed leaves behind is not heeded.
        std::fs::write(&path, key(3).to_string()).unwrap();
        assert_eq!(posted(address), None);
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn one_who_listens_everywhere_is_found_at_an_address_of_this_computer_only() {
        let everywhere = Ticket { address: route("0.0.0.0:3"), key: key(1) };
        let _posted = PostedTicket::post(everywhere).unwrap();
        assert_eq!(posted(route("127.0.0.1:3")), Some(key(1)));
        assert_eq!(posted(route("192.0.2.77:3")), None, "that is another computer's");
        let told = for_others(everywhere);
        assert!(!told.address.socket_address().unwrap().ip().is_unspecified() && told.key == everywhere.key);
        let one = Ticket { address: route("127.0.0.1:3"), ..everywhere };
        assert_eq!(for_others(one), one);
    }
}
