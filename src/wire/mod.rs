//! The protocol of the IMAX, SMC and MBOX controllers: octets to messages and back. Any thread; allocates nothing.
