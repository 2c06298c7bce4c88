//! Virtual controllers that behave as the manual says: the same wire, seen from the other end.
