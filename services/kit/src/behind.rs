//! Health of the services behind a port, told at that port under their own gRPC names.

use crate::auth::Connection;
use crate::server::Context;
use futures::future::join_all;
use std::time::Duration;
use tonic_health::ServingStatus;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus as Answer;
use tonic_health::pb::health_client::HealthClient;
use tonic_health::server::HealthReporter;

/// Interval of the questions, and the time that an answer may take. A dead service is told within twice this.
const EVERY: Duration = Duration::from_millis(500);

/// Asks each service (gRPC name, connection) until shutdown, and reports what it answers.
pub fn follow(reporter: HealthReporter, ctx: &Context, services: Vec<(&'static str, Connection)>) {
    let shutdown = ctx.shutdown.clone();
    tokio::spawn(async move {
        let mut tick = tokio::time::interval(EVERY);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                () = shutdown.cancelled() => return,
                _ = tick.tick() => {}
            }
            let questions = services
                .iter()
                .map(|(name, channel)| ask(name, channel.clone()));
            for ((name, _), status) in services.iter().zip(join_all(questions).await) {
                let serves = f64::from(matches!(status, ServingStatus::Serving));
                metrics::gauge!("tryon_behind_serving", "service" => *name).set(serves);
                reporter.set_service_status(name, status).await;
            }
        }
    });
}

/// Status of one service; a silent one does not serve.
async fn ask(name: &str, channel: Connection) -> ServingStatus {
    let question = HealthCheckRequest {
        service: name.into(),
    };
    let answer = tokio::time::timeout(EVERY, HealthClient::new(channel).check(question)).await;
    match answer {
        Ok(Ok(r)) if r.get_ref().status() == Answer::Serving => ServingStatus::Serving,
        _ => ServingStatus::NotServing,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::Credentials;
    use crate::client::channel;
    use crate::connections;
    use crate::tls::Tls;
    use tokio::net::TcpListener;

    fn connect(url: &str) -> Connection {
        Credentials::none().present(channel(url, &Tls::off()).expect("a URL"))
    }

    #[tokio::test]
    async fn a_service_that_serves_is_told_from_one_that_is_dead() {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("bound"));
        let reporter = HealthReporter::new();
        reporter
            .set_service_status("up", ServingStatus::Serving)
            .await;
        let service = tonic_health::server::HealthService::from_health_reporter(reporter);
        let server = tonic::transport::Server::builder()
            .add_service(tonic_health::pb::health_server::HealthServer::new(service))
            .serve_with_incoming(connections::accept(
                listener,
                connections::Limits::default(),
            ));
        tokio::spawn(server);

        let living = connect(&url);
        assert!(matches!(
            ask("up", living.clone()).await,
            ServingStatus::Serving
        ));
        assert!(matches!(
            ask("other", living).await,
            ServingStatus::NotServing
        ));
        let dead = connect("http://127.0.0.1:1");
        assert!(matches!(ask("up", dead).await, ServingStatus::NotServing));
    }
}
