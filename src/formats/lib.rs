//! Files in and out: MCAP, RGBD folders, npz bodies, OBJ, glTF, patterns. Bytes to domain types, never a panic.
//!
//! # Ideas
//!
//! Body:
//!
//! - Bodies in SMPL's layout: [`mod@npz`], `src/body/import.rs`.
//!
//! Patterns of other programs: [`mod@garmentcode`]; refused: [`mod@foreign_pattern`].
//!
//! Camera and files:
//!
//! - Recordings: [`mod@recording`], [`mod@rgbd_folder`], [`mod@k4a_file`], [`mod@r3d_file`], [`mod@npz_recording`];
//!   messages ([`mod@messages`]) live ([`mod@live`]), in [`mod@mcap_file`], [`mod@bag_file`] and [`mod@rosbag2`]; rectified:
//!   [`mod@rectified`]; set upright: [`mod@reoriented`].
//! - Lossless depth compression: [`mod@image::depth_codec`].
//! - Motion clips: [`mod@bvh`], [`mod@asf_amc`], [`mod@amass`].
//! - GlTF, OBJ, MakeHuman: [`mod@gltf`], [`mod@obj`], [`mod@mhclo`]; unit and axes of a mesh file: [`mod@mesh_frame`].
//! - Image size limits: [`mod@image::limits`].
//!
//! Wire and processes:
//!
//! - Compression of positions, keyframe or delta: [`mod@position_codec`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod amass;
mod asf_amc;
mod bag_file;
mod bvh;
mod camera_json;
mod chunk_records;
mod converted;
mod depth_metres;
mod error;
pub mod fabric_json;
mod face_origins;
pub mod foreign_pattern;
mod foxglove;
pub mod garmentcode;
pub mod gltf;
pub mod image;
mod k4a_file;
mod mcap_file;
pub mod mesh_frame;
mod messages;
pub mod mhclo;
pub mod morph_target;
mod motion;
mod motion_clip;
pub mod npy;
mod npy_frames;
pub mod npz;
mod npz_file;
mod npz_recording;
pub mod obj;
mod obj_faces;
mod obj_parser;
mod obj_records;
mod obj_scene;
mod obj_text;
mod polygon;
mod pose_feature;
mod position_codec;
mod private_file;
mod r3d_file;
mod recording;
mod rectified;
mod reoriented;
mod rgbd_folder;
mod rgbd_source;
mod rosbag2;
pub mod scan;
pub mod sewn_obj;
mod shared_data;
mod sibling;
mod text_encoding;
mod texture_points;
mod zip_entries;

pub use camera_json::CameraFile;
pub use error::FormatError;
pub use face_origins::{FaceOrigin, FaceOrigins, PartName};
pub use k4a_file::K4aReader;
pub use mcap_file::McapWriter;
pub use mesh_frame::{FrameOptions, MeshAxis, MeshFrame};
pub use messages::live;
pub use motion::read_motion;
pub use motion_clip::MotionClip;
pub use npy_frames::NpyFrames;
pub use npz_recording::NpzReader;
pub use obj_scene::write_obj_scene;
pub use pose_feature::{PoseDirections, PoseFeature};
pub use position_codec::{PositionCoder, STEP as POSITION_STEP};
pub use r3d_file::R3dReader;
pub use recording::{RECORDING_EXTENSIONS, RecordingOptions, open_recording, open_recording_with};
pub use rectified::Rectified;
pub use reoriented::Reoriented;
pub use rgbd_folder::{RgbdFolder, RgbdFolderWriter, depth_to_mm, read_camera};
pub use rgbd_source::RgbdSource;
pub use shared_data::shared_data;
pub use texture_points::TexturePoint;
