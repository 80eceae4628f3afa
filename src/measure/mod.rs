//! Features measured from the points near their nominal place.
