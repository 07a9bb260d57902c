"""Devices of the programs in examples/cameras, as far as there are any without hardware, and what they show."""
