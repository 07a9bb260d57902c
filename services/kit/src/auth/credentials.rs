//! Token that a process presents to its neighbours.

use std::path::Path;
use tokio::sync::watch;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Channel;
use tonic::{Request, Status};

type Header = MetadataValue<Ascii>;

/// Channel whose calls carry the process's token.
pub type Connection = InterceptedService<Channel, Credentials>;

/// A token or none, as of the last reading of its file. Clones share it.
#[derive(Clone, Debug)]
pub struct Credentials(watch::Receiver<Option<Header>>);

impl Credentials {
    /// No token.
    pub fn none() -> Self {
        Self(watch::channel(None).1)
    }

    /// This token; characters that no header may have make it none.
    pub fn fixed(token: &str) -> Self {
        Self(watch::channel(header(token).ok()).1)
    }

    /// The token of a file, read again when it changes, on a task of the runtime.
    ///
    /// # Errors
    /// When it cannot be read now.
    pub fn follow(file: &Path) -> Result<Self, String> {
        crate::followed::follow(file, |text| header(text).map(Some)).map(Self)
    }

    /// Lets the calls of a channel carry the token.
    pub fn present(&self, channel: Channel) -> Connection {
        InterceptedService::new(channel, self.clone())
    }
}

fn header(token: &str) -> Result<Header, String> {
    let text = format!("Bearer {}", token.trim());
    let mut header = Header::try_from(text).map_err(|_| "no token".to_owned())?;
    // Kept out of HPACK's tables and of everything that prints headers.
    header.set_sensitive(true);
    Ok(header)
}

impl Interceptor for Credentials {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(header) = &*self.0.borrow() {
            let metadata = request.metadata_mut();
            metadata.insert("authorization", header.clone());
        }
        Ok(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_carry_the_token_and_nothing_prints_it() {
        let sent = |mut c: Credentials| c.call(Request::new(())).expect("passed on");
        let request = sent(Credentials::fixed("abc\n"));
        let value = request.metadata().get("authorization").expect("sent");
        assert_eq!(value, "Bearer abc");
        assert!(!format!("{:?}", request.metadata()).contains("abc"));
        assert!(sent(Credentials::none()).metadata().is_empty());
        assert!(sent(Credentials::fixed("a\nb")).metadata().is_empty());
    }
}
