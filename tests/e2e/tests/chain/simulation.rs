//! A simulation on request: every frame, in order, to any number of readers; faults name their field.

use crate::kiosk::{Kiosk, Part};
use tonic::Code;
use tonic::transport::Channel;
use tryon_proto::v1::cloth_service_client::ClothServiceClient;
use tryon_proto::v1::start_simulation_request::Start;
use tryon_proto::v1::*;

const RATE: f64 = 30.0;
const FRAMES: u32 = 16;

/// A square of two triangles that falls freely for half a second.
fn falling(change: impl Fn(&mut serde_json::Value)) -> StartSimulationRequest {
    let mut scene = serde_json::json!({
        "mesh_obj": "v 0 1 0\nv 0.1 1 0\nv 0.1 1 0.1\nv 0 1 0.1\nf 1 2 3\nf 1 3 4\n",
        "material": {
            "area_density_kg_m2": 0.2, "thickness_m": 4e-4, "young_membrane_N_m": 500.0, "poisson": 0.3,
            "bending_rigidity_N_m": 1e-5, "friction": 0.3
        },
        "gravity": [0.0, -9.81, 0.0], "duration_s": 0.5, "output_fps": RATE
    });
    change(&mut scene);
    StartSimulationRequest {
        start: Some(Start::SceneJson(scene.to_string())),
        ..Default::default()
    }
}

/// Mean height of each frame from `first` on, of `count` frames in all.
async fn heights(
    c: &mut ClothServiceClient<Channel>,
    id: &str,
    first: u32,
    count: u32,
) -> Vec<f64> {
    let r = FollowSimulationRequest {
        simulation_id: id.into(),
        first_frame: first,
    };
    let mut frames = c.follow_simulation(r).await.expect("followed").into_inner();
    let mut out = Vec::new();
    while let Some(f) = frames.message().await.expect("a frame") {
        assert_eq!(
            (f.frame, f.frame_count, f.positions.len()),
            (first + out.len() as u32, count, 4 * 12)
        );
        let y = f
            .positions
            .chunks_exact(12)
            .map(|p| f32::from_le_bytes([p[4], p[5], p[6], p[7]]));
        out.push(y.map(f64::from).sum::<f64>() / 4.0);
    }
    out
}

#[test]
fn a_simulation_on_request_falls_as_bodies_fall() {
    let kiosk = Kiosk::start("pattern", 10.0);
    super::client(async {
        let mut c = ClothServiceClient::new(kiosk.channel(Part::Cloth));
        for solver in [ClothSolver::Realtime, ClothSolver::Offline] {
            let started = c
                .start_simulation(StartSimulationRequest {
                    solver: solver.into(),
                    ..falling(|_| ())
                })
                .await
                .expect("started")
                .into_inner();
            assert_eq!((started.frame_count, started.vertex_count), (FRAMES, 4));
            let all = heights(&mut c, &started.simulation_id, 0, FRAMES).await;
            assert_eq!(all.len(), FRAMES as usize);
            for (k, y) in all.iter().enumerate() {
                let t = k as f64 / RATE;
                // Implicit steps run ahead of ½gt² by at most half a step's fall; a step is no longer than a frame.
                let fallen = 1.0 - y - 0.5 * 9.81 * t * t;
                assert!(
                    (-1e-4..=9.81 * t / RATE).contains(&fallen),
                    "{solver:?}, frame {k}: {fallen} m beyond the closed form"
                );
            }
            // A second reader, later and from the middle, sees the same frames.
            assert_eq!(
                heights(&mut c, &started.simulation_id, 10, FRAMES).await,
                all[10..]
            );
            let beyond = FollowSimulationRequest {
                simulation_id: started.simulation_id,
                first_frame: FRAMES,
            };
            assert_eq!(
                c.follow_simulation(beyond)
                    .await
                    .expect_err("beyond")
                    .code(),
                Code::InvalidArgument
            );
        }

        let faults = [
            (
                falling(|s| s["mesh_obj"] = "v 0 0 0\nf 1 2 3\n".into()),
                "face 0",
            ),
            (falling(|s| s["duration_s"] = (-1.0).into()), "duration_s"),
            (
                falling(|s| s["pinned_vertices"] = vec![9].into()),
                "pinned_vertices",
            ),
            (
                falling(|s| {
                    s.as_object_mut().expect("an object").remove("mesh_obj");
                    s["mesh"] = "/etc/passwd".into();
                }),
                "mesh: no files are read here",
            ),
        ];
        for (request, part) in faults {
            let e = c.start_simulation(request).await.expect_err("refused");
            assert!(
                e.code() == Code::InvalidArgument && e.message().contains(part),
                "{part}: {e}"
            );
        }
        let gone = FollowSimulationRequest {
            simulation_id: "other".into(),
            first_frame: 0,
        };
        assert_eq!(
            c.follow_simulation(gone).await.expect_err("unknown").code(),
            Code::NotFound
        );
    });
}

#[test]
fn a_cancelled_simulation_continues_to_the_same_bits() {
    let kiosk = Kiosk::start("pattern", 10.0);
    super::client(async {
        let mut c = ClothServiceClient::new(kiosk.channel(Part::Cloth));
        let offline = StartSimulationRequest {
            solver: ClothSolver::Offline.into(),
            ..falling(|s| s["duration_s"] = 200.0.into())
        };
        let started = c.start_simulation(offline.clone()).await.expect("started");
        let id = started.into_inner().simulation_id;
        let cancel = CancelSimulationRequest { simulation_id: id };
        let first = c
            .cancel_simulation(cancel.clone())
            .await
            .expect("cancelled");
        let first = first.into_inner();
        let again = c.cancel_simulation(cancel.clone()).await;
        assert_eq!(again.expect("cancelled before").into_inner(), first);
        let unaided = StartSimulationRequest {
            start: Some(Start::SimulationId(cancel.simulation_id)),
            ..Default::default()
        };
        let refused = c.start_simulation(unaided).await.expect_err("a scene");
        let is_named = refused.message().contains("checkpoint");
        assert!(
            is_named && refused.code() == Code::FailedPrecondition,
            "{refused}"
        );

        // Half a second more than the first simulation came to.
        let count = first.next_frame + FRAMES;
        let whole = StartSimulationRequest {
            start: falling(|s| s["duration_s"] = (f64::from(count - 1) / RATE).into()).start,
            ..offline
        };
        let rest = StartSimulationRequest {
            checkpoint: first.checkpoint,
            ..whole.clone()
        };
        let resumed = c.start_simulation(rest.clone()).await.expect("resumed");
        let resumed = resumed.into_inner();
        assert_eq!(resumed.first_frame, first.next_frame);
        let from = first.next_frame;
        let resumed = heights(&mut c, &resumed.simulation_id, from, count).await;
        let started = c.start_simulation(whole).await.expect("started");
        let whole = heights(&mut c, &started.into_inner().simulation_id, from, count).await;
        assert_eq!(resumed.len(), FRAMES as usize);
        assert_eq!(resumed, whole);

        let mut damaged = rest.checkpoint.to_vec();
        damaged.truncate(damaged.len() / 2);
        let mut refuse = async |request: StartSimulationRequest, part: &str| {
            let e = c.start_simulation(request).await.expect_err("refused");
            let is_named = e.message().contains("checkpoint") && e.message().contains(part);
            assert!(e.code() == Code::InvalidArgument && is_named, "{part}: {e}");
        };
        let damaged = StartSimulationRequest {
            checkpoint: damaged.into(),
            ..rest.clone()
        };
        refuse(damaged, "damaged").await;
        let realtime = StartSimulationRequest {
            solver: ClothSolver::Realtime.into(),
            ..rest
        };
        refuse(realtime, "only the offline solver").await;
    });
}
