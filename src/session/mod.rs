//! The life of one try-on as a pure transition table: Opening → Calibrating → Live ⇄ Degraded(why) → Draining → Closed.
