//! Who may call what: every method of reflection with good and bad tokens, streams that end with theirs, codes.

use crate::client;
use crate::kiosk::{Kiosk, PARTS, Part};
use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tempfile::TempDir;
use tokio::time::timeout;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::{Code, Request, Status, Streaming};
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;
use tonic_reflection::pb::v1::ServerReflectionRequest;
use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;
use tryon_kit::auth::{Claims, Connection, Credentials, Enrolments, Issuer};
use tryon_proto::Message;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::*;

/// Time within which a stream ends after its token.
const SECOND: Duration = Duration::from_secs(1);
/// Time for anything that has to happen at some point.
const PATIENCE: Duration = Duration::from_secs(20);

/// A box that asks for tokens, and the issuer of them.
pub struct Guarded {
    pub kiosk: Kiosk,
    issuer: Issuer,
    folder: TempDir,
}

impl Guarded {
    /// Starts it with the front camera on `source`.
    pub fn start(source: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let issuer = Issuer::generate().expect("random");
        let [_, public] = issuer.write(folder.path()).expect("written");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("revoked"), "gone\n").expect("written");
        let all = ["capture", "tracking", "cloth", "compositor"];
        let own = issuer.issue_for_process("store", &all).expect("short");
        std::fs::write(at("token"), own).expect("written");
        let kiosk = Kiosk::with(source, 10.0, |c| {
            c.auth.keys = vec![public];
            (c.auth.revoked, c.auth.token) = (at("revoked"), at("token"));
            c.auth.enrolments = at("codes");
        });
        Self {
            kiosk,
            issuer,
            folder,
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Token of the whole store for an hour, with changes.
    pub fn token(&self, change: impl FnOnce(&mut Claims)) -> String {
        let mut claims = Claims {
            aud: PARTS.map(|p| format!("{p:?}").to_lowercase()).to_vec(),
            exp: now() + 3600,
            nbf: None,
            jti: "good".into(),
            store: "store".into(),
            camera: None,
            session: None,
            methods: vec!["*".into()],
        };
        change(&mut claims);
        self.issuer.issue(&claims).expect("short")
    }

    pub fn connect(&self, part: Part, token: Option<&str>) -> Connection {
        let credentials = token.map_or_else(Credentials::none, Credentials::fixed);
        credentials.present(self.kiosk.channel(part))
    }

    pub fn compositor(&self, token: Option<&str>) -> CompositorServiceClient<Connection> {
        CompositorServiceClient::new(self.connect(Part::Compositor, token))
    }

    /// Tokens that no method may take.
    fn bad_tokens(&self) -> Vec<(&'static str, Option<String>)> {
        let good = self.token(|_| {});
        let claims = good.split('.').nth(1).expect("three parts");
        let foreign = Issuer::generate().expect("random");
        let foreign =
            foreign.issue_for_process("store", &["capture", "tracking", "cloth", "compositor"]);
        vec![
            ("none", None),
            ("expired", Some(self.token(|c| c.exp = now() - 1))),
            ("early", Some(self.token(|c| c.nbf = Some(now() + 60)))),
            (
                "audience",
                Some(self.token(|c| c.aud = vec!["elsewhere".into()])),
            ),
            ("store", Some(self.token(|c| c.store = "elsewhere".into()))),
            (
                "method",
                Some(self.token(|c| c.methods = vec!["Elsewhere".into()])),
            ),
            ("revoked", Some(self.token(|c| c.jti = "gone".into()))),
            ("foreign", Some(foreign.expect("short"))),
            // {"alg":"none"}
            ("unsigned", Some(format!("eyJhbGciOiJub25lIn0.{claims}."))),
            ("garbage", Some("..".into())),
        ]
    }
}

fn now() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.expect("after 1970").as_secs()
}

/// A method that a port answers.
struct Method {
    path: String,
    /// Its first field is a session's id.
    has_session: bool,
}

/// Answers of reflection.
async fn ask(connection: Connection, question: MessageRequest) -> Result<MessageResponse, Status> {
    let request = ServerReflectionRequest {
        host: String::new(),
        message_request: Some(question),
    };
    let mut reflection = ServerReflectionClient::new(connection);
    let asked = reflection.server_reflection_info(tokio_stream::once(request));
    let answer = asked.await?.into_inner().message().await?;
    Ok(answer.and_then(|a| a.message_response).expect("an answer"))
}

/// Names of the services of a port.
pub async fn services(connection: Connection) -> Vec<String> {
    let list = ask(connection, MessageRequest::ListServices(String::new())).await;
    let MessageResponse::ListServicesResponse(list) = list.expect("listed") else {
        panic!("no list");
    };
    list.service.into_iter().map(|s| s.name).collect()
}

/// Every method of a port but health's.
async fn methods(connection: Connection) -> Vec<Method> {
    let reflection = "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo";
    let mut found: Vec<Method> = [reflection.to_owned(), reflection.replace("v1", "v1alpha")]
        .map(|path| Method {
            path,
            has_session: false,
        })
        .into();
    for service in services(connection.clone()).await {
        if service.starts_with("grpc.health") {
            continue;
        }
        let question = MessageRequest::FileContainingSymbol(service.clone());
        let MessageResponse::FileDescriptorResponse(files) =
            ask(connection.clone(), question).await.expect("described")
        else {
            panic!("no file");
        };
        for file in files.file_descriptor_proto {
            let file = prost_types::FileDescriptorProto::decode(&file[..]).expect("a file");
            found.extend(methods_of(&file, &service));
        }
    }
    found
}

fn methods_of(file: &prost_types::FileDescriptorProto, service: &str) -> Vec<Method> {
    let of_service = |s: &&prost_types::ServiceDescriptorProto| {
        format!("{}.{}", file.package(), s.name()) == service
    };
    let has_session = |input: &str| {
        let name = input.rsplit('.').next().expect("a name");
        let message = file.message_type.iter().find(|m| m.name() == name);
        message.is_some_and(|m| {
            let first = m.field.iter().find(|f| f.number() == 1);
            first.is_some_and(|f| ["session_id", "try_on_id"].contains(&f.name()))
        })
    };
    let described = file.service.iter().filter(of_service);
    described
        .flat_map(|s| &s.method)
        .map(|m| Method {
            path: format!("/{service}/{}", m.name()),
            has_session: has_session(m.input_type()),
        })
        .collect()
}

/// Code of a call whose message has only its first field, a string.
async fn code(connection: Connection, method: &Method, first: &str) -> Code {
    let mut grpc = Grpc::new(connection);
    grpc.ready().await.expect("connects");
    let path = PathAndQuery::try_from(method.path.as_str()).expect("a path");
    let codec = tonic_prost::ProstCodec::<String, ()>::default();
    let request = Request::new(first.to_owned());
    match grpc.server_streaming(request, path, codec).await {
        Err(status) => status.code(),
        Ok(answer) => {
            let mut answer: Streaming<()> = answer.into_inner();
            let first = timeout(Duration::from_millis(500), answer.message()).await;
            first.map_or(Code::Ok, |m| m.map_or_else(|s| s.code(), |_| Code::Ok))
        }
    }
}

fn is_refused(code: Code) -> bool {
    matches!(code, Code::Unauthenticated | Code::PermissionDenied)
}

#[test]
fn no_method_takes_a_bad_token_and_all_take_a_good_one() {
    let guarded = Guarded::start("pattern");
    let (good, bad) = (guarded.token(|_| {}), guarded.bad_tokens());
    let bound = guarded.token(|c| c.session = Some("mine".into()));
    client(async {
        let mut calls = 0;
        for part in PARTS {
            let connect = |token: Option<&str>| guarded.connect(part, token);
            for method in methods(connect(Some(&good))).await {
                for (kind, token) in &bad {
                    let code = code(connect(token.as_deref()), &method, "").await;
                    assert!(is_refused(code), "{kind} at {}: {code:?}", method.path);
                    calls += 1;
                }
                let right = code(connect(Some(&good)), &method, "").await;
                assert!(!is_refused(right), "good at {}: {right:?}", method.path);
                if method.has_session {
                    let foreign = code(connect(Some(&bound)), &method, "theirs").await;
                    assert_eq!(foreign, Code::PermissionDenied, "{}", method.path);
                    let own = code(connect(Some(&bound)), &method, "mine").await;
                    assert!(!is_refused(own), "own session at {}", method.path);
                }
            }
            let mut health = HealthClient::new(connect(None));
            let probe = health.check(HealthCheckRequest::default()).await;
            assert!(probe.is_ok(), "probes carry no token");
        }
        assert!(calls > 200, "{calls} calls");
        // The compositor called cloth with its own token, not with the client's.
        let only = guarded.token(|c| c.aud = vec!["compositor".into()]);
        let mut page = guarded.compositor(Some(&only));
        let list = page.list_garment_choices(ListGarmentChoicesRequest {});
        assert!(!list.await.expect("listed").into_inner().garments.is_empty());
    });
}

/// Opens a try-on and reads its stream until the first picture.
async fn watch(
    compositor: &mut CompositorServiceClient<Connection>,
    id: &str,
) -> Streaming<StreamFramesResponse> {
    let open = OpenTryOnRequest {
        try_on_id: id.into(),
        consent: Some(Consent { given: true }),
        ..OpenTryOnRequest::default()
    };
    compositor.open_try_on(open).await.expect("opened");
    let request = StreamFramesRequest {
        try_on_id: id.into(),
        ..StreamFramesRequest::default()
    };
    let stream = compositor.stream_frames(request).await;
    let mut stream = stream.expect("streams").into_inner();
    let first = timeout(PATIENCE, stream.message()).await.expect("in time");
    first.expect("fine").expect("a message");
    stream
}

/// Status with which a stream ends.
async fn end(stream: &mut Streaming<StreamFramesResponse>) -> Status {
    loop {
        match stream.message().await {
            Ok(Some(_)) => {}
            Ok(None) => return Status::ok(""),
            Err(status) => return status,
        }
    }
}

#[test]
fn open_streams_end_with_their_tokens() {
    let guarded = Guarded::start("pattern");
    client(async {
        let lost = guarded.token(|c| c.jti = "lost".into());
        let kept = guarded.token(|_| {});
        let mut streams = [
            watch(&mut guarded.compositor(Some(&lost)), "a").await,
            watch(&mut guarded.compositor(Some(&kept)), "a").await,
        ];
        std::fs::write(guarded.file("revoked"), "gone\nlost\n").expect("written");
        let told = timeout(SECOND, end(&mut streams[0])).await;
        assert_eq!(told.expect("within a second").code(), Code::Unauthenticated);
        let other = timeout(SECOND, end(&mut streams[1])).await;
        assert!(other.is_err(), "the neighbour's stream goes on");

        let brief = guarded.token(|c| c.exp = now() + 3);
        let mut stream = watch(&mut guarded.compositor(Some(&brief)), "a").await;
        let told = timeout(3 * SECOND + SECOND, end(&mut stream)).await;
        let told = told.expect("a second after its end");
        assert_eq!(told.code(), Code::Unauthenticated);
        assert!(told.message().contains("expired"), "{told}");
    });
}

#[test]
fn a_code_is_traded_once_for_a_token_of_one_camera() {
    let guarded = Guarded::start("pattern");
    let token = guarded.token(|c| c.camera = Some("front".into()));
    let codes = Enrolments::new(&guarded.file("codes"));
    let code = codes.offer(&token).expect("drawn");
    let redeem = async |code: &str, token: Option<&str>| {
        let mut compositor = guarded.compositor(token);
        let code = code.into();
        compositor.redeem_code(RedeemCodeRequest { code }).await
    };
    client(async {
        let wrong = redeem("0000-0000-0000", None).await.expect_err("a guess");
        assert_eq!(wrong.code(), Code::Unauthenticated);
        let idle = redeem(&code, Some(&token)).await.expect_err("has a token");
        assert_eq!(idle.code(), Code::FailedPrecondition);
        let traded = redeem(&code, None).await.expect("traded");
        let traded = traded.into_inner().token;
        assert_eq!(traded, token);
        let again = redeem(&code, None).await.expect_err("used");
        assert_eq!(again.code(), Code::Unauthenticated);

        let mut kiosk = guarded.compositor(Some(&traded));
        watch(&mut kiosk, "mine").await;
        let side = |id: &str| OpenTryOnRequest {
            try_on_id: id.into(),
            camera: "side".into(),
            consent: Some(Consent { given: true }),
            ..OpenTryOnRequest::default()
        };
        let denied = kiosk.open_try_on(side("other")).await;
        let denied = denied.expect_err("another camera");
        assert_eq!(denied.code(), Code::PermissionDenied);
        let owner = guarded.token(|_| {});
        let mut owner = guarded.compositor(Some(&owner));
        owner.open_try_on(side("theirs")).await.expect("opened");
        let request = StreamFramesRequest {
            try_on_id: "theirs".into(),
            ..StreamFramesRequest::default()
        };
        let denied = kiosk.stream_frames(request).await;
        let denied = denied.expect_err("a try-on of another camera");
        assert_eq!(denied.code(), Code::PermissionDenied);
    });
}
