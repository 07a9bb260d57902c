//! Which pixels are the person: floor, background, nearest body, edges.
