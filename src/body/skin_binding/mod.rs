//! Points bound to the skin of a body: the skin below them, the joints they follow, their places in other poses.

mod binding;
pub(crate) mod posed_skin;
mod skin_search;

pub use binding::{SkinBinding, VertexWeights};
pub use posed_skin::PosedSkin;
pub use skin_search::SkinSearch;
