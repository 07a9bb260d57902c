//! Tests of whole sheets: closed forms, measured fabrics.

use super::*;

mod cantilever;
mod curves;
mod picture_frame;
mod statics;
