//! Run time against error: standard scenes, methods side by side, tables and plots behind `tryon bench`.
