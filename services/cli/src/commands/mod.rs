//! Commands of the command line, one file each.

pub(crate) mod camera;
pub(crate) mod clothcap;
pub(crate) mod composite;
pub(crate) mod demo;
pub(crate) mod doctor;
pub(crate) mod export;
pub(crate) mod fine;
pub(crate) mod identity;
pub(crate) mod import;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod run;
pub(crate) mod run_offline;
pub(crate) mod simulate;
pub(crate) mod token;
pub(crate) mod track;
pub(crate) mod up;
