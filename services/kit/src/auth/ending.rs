//! Body of an answer that ends with its token: the rest is cut off, and the status says why.

use axum::body::{Body, Bytes, HttpBody};
use futures::future::BoxFuture;
use http::HeaderMap;
use http_body::{Frame, SizeHint};
use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};
use tonic::Status;

/// Answer of a call until `end` gives the reason of a premature end.
pub(super) struct Ending {
    inner: Body,
    end: BoxFuture<'static, &'static str>,
    is_over: bool,
}

impl Ending {
    pub(super) fn new(
        inner: Body,
        end: impl Future<Output = &'static str> + Send + 'static,
    ) -> Self {
        Self {
            inner,
            end: Box::pin(end),
            is_over: false,
        }
    }
}

impl HttpBody for Ending {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.is_over {
            return Poll::Ready(None);
        }
        if let Poll::Ready(why) = self.end.as_mut().poll(cx) {
            self.is_over = true;
            // The handler's stream is dropped at once, with what it holds.
            self.inner = Body::empty();
            let mut trailers = HeaderMap::new();
            let told = Status::unauthenticated(why).add_header(&mut trailers);
            return Poll::Ready(told.is_ok().then(|| Ok(Frame::trailers(trailers))));
        }
        Pin::new(&mut self.inner).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.is_over || self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        // A length that is promised could not be cut.
        if self.inner.is_end_stream() {
            SizeHint::with_exact(0)
        } else {
            SizeHint::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures::StreamExt;

    /// Frames until the end.
    async fn all(mut body: Ending) -> Vec<Frame<Bytes>> {
        let next = |cx: &mut Context<'_>| Pin::new(&mut body).poll_frame(cx);
        let frames = futures::stream::poll_fn(next);
        frames.map(|f| f.expect("a frame")).collect().await
    }

    #[tokio::test]
    async fn the_end_cuts_a_stream_and_tells_why() {
        let (tx, rx) = tokio::sync::oneshot::channel::<()>();
        let ticks = futures::stream::iter([Ok::<_, axum::Error>(Bytes::from_static(b"x"))]);
        let endless = ticks.chain(futures::stream::pending());
        let end = async move {
            let _ = rx.await;
            "revoked"
        };
        let body = Ending::new(Body::from_stream(endless), end);
        let read = tokio::spawn(all(body));
        tokio::task::yield_now().await;
        drop(tx);
        let frames = read.await.expect("no panic");
        let trailers = frames.last().and_then(Frame::trailers_ref).expect("told");
        assert_eq!(trailers.get("grpc-status").expect("a status"), "16");
    }

    #[tokio::test]
    async fn without_an_end_the_body_is_what_it_was() {
        let body = Ending::new(Body::from("abc"), std::future::pending());
        let frames = all(body).await;
        assert_eq!(frames[0].data_ref().expect("data"), "abc");
        assert_eq!(frames.len(), 1);
        let none = Ending::new(Body::empty(), std::future::pending());
        assert!(none.is_end_stream());
    }
}
