//! One step from a frame and the last state to pose, displacements and a confidence report.
