//! How many connections there are at once, and for how long one may be idle: the process keeps handles for its session, and strangers
//! who connect and say nothing keep nobody out for long.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::serve::Listener;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep, sleep};

/// Connections at once, where the system has handles enough.
const MAX_CONNECTIONS: usize = 48;
/// Handles that are kept for sessions: sockets, recordings, and those of the next session while the last one ends.
const KEPT_HANDLES: u64 = 48;
/// Where there are fewer handles than that, a few connections are let in all the same.
const MIN_CONNECTIONS: usize = 4;

/// How many connections there may be at once in this process.
pub(crate) fn allowed() -> usize {
    let handles = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
    allowed_with(handles.unwrap_or(u64::MAX))
}

fn allowed_with(handles: u64) -> usize {
    let left = usize::try_from(handles.saturating_sub(KEPT_HANDLES)).unwrap_or(usize::MAX);
    left.clamp(MIN_CONNECTIONS, MAX_CONNECTIONS)
}

/// Accepts no more than so many connections at once; further ones wait in the system, where they take no handle of this process.
pub(crate) struct LimitedListener {
    inner: TcpListener,
    places: Arc<Semaphore>,
    patience: Duration,
}

impl LimitedListener {
    /// A connection on which this server could write nothing for `patience` is closed: one that has not asked for anything by
    /// then, also one that asks letter by letter, or that does not read the answer.
    pub(crate) fn new(inner: TcpListener, max: usize, patience: Duration) -> Self {
        Self { inner, places: Arc::new(Semaphore::new(max)), patience }
    }
}

impl Listener for LimitedListener {
    type Io = LimitedStream;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (LimitedStream, SocketAddr) {
        let place = Arc::clone(&self.places).acquire_owned().await.expect("the semaphore is never closed");
        // Errors of the system (no handles, a connection that is gone already) are waited out there.
        let (stream, address) = Listener::accept(&mut self.inner).await;
        let (patience, closes) = (self.patience, Box::pin(sleep(self.patience)));
        (LimitedStream { stream, patience, closes, _place: place }, address)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.inner.local_addr()
    }
}

/// A connection that is closed when nothing could be written on it for too long.
pub(crate) struct LimitedStream {
    stream: TcpStream,
    patience: Duration,
    closes: Pin<Box<Sleep>>,
    _place: OwnedSemaphorePermit,
}

impl LimitedStream {
    /// What is not ready is an error once the patience is over.
    fn in_time<T>(&mut self, context: &mut Context<'_>, poll: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if poll.is_ready() {
            return poll;
        }
        ready!(self.closes.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for LimitedStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let poll = Pin::new(&mut self.stream).poll_read(context, buffer);
        self.in_time(context, poll)
    }
}

impl AsyncWrite for LimitedStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let poll = Pin::new(&mut self.stream).poll_write(context, bytes);
        if let Poll::Ready(Ok(1..)) = poll {
            let closes_at = Instant::now() + self.patience;
            self.closes.as_mut().reset(closes_at);
        }
        self.in_time(context, poll)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    /// Runs what is given a listener with two places, and connections to it.
    fn with_listener<F: Future>(test: impl FnOnce(LimitedListener, SocketAddr) -> F) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let inner = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let address = inner.local_addr().unwrap();
            test(LimitedListener::new(inner, 2, Duration::from_millis(50)), address).await;
        });
    }

    #[test]
    fn handles_are_kept_for_the_session() {
        assert_eq!([96, 256, u64::MAX, 60, 10].map(allowed_with), [48, 48, 48, 12, 4]);
    }

    #[test]
    fn a_third_connection_is_let_in_when_an_idle_one_is_closed() {
        with_listener(async |mut listener, address| {
            let _waiting = [
                TcpStream::connect(address).await.unwrap(),
                TcpStream::connect(address).await.unwrap(),
                TcpStream::connect(address).await.unwrap(),
            ];
            let (mut one, _) = listener.accept().await;
            let (_two, _) = listener.accept().await;
            assert_eq!(listener.places.available_permits(), 0);
            let error = one.read_u8().await.unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::TimedOut);
            drop(one);
            let (_three, _) = listener.accept().await;
        });
    }

    #[test]
    fn asking_letter_by_letter_does_not_keep_a_connection_and_being_answered_does() {
        with_listener(async |mut listener, address| {
            let mut far = TcpStream::connect(address).await.unwrap();
            let (mut near, _) = listener.accept().await;
            let mut letters = 0;
            let error = loop {
                far.write_all(b"x").await.unwrap();
                match near.read_u8().await {
                    Ok(_) => letters += 1,
                    Err(error) => break error,
                }
                if let Err(error) =
                    tokio::time::timeout(Duration::from_millis(20), near.read_u8()).await.unwrap_or(Ok(0))
                {
                    break error;
                }
            };
            assert!(error.kind() == io::ErrorKind::TimedOut && letters >= 1, "{error}, {letters}");
            near.write_all(b"an answer").await.unwrap();
            far.write_all(b"y").await.unwrap();
            assert_eq!(near.read_u8().await.unwrap(), b'y');
        });
    }
}
