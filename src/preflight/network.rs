//! The way to a controller and back.

use super::{Check, Notes, ShowTerms, Subject};

/// True if datagrams get there, whole.
pub(super) fn judge_way(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    let address = subject.controller.connection.address;
    match &subject.route {
        Err(why) => {
            let found = format!("no route to {address}: {why}");
            notes.add(Check::Route, found, "check the cable, this machine's address and mask, and bind");
        }
        Ok(route) => {
            let need = terms.packet_len(subject.controller);
            if usize::try_from(route.mtu).is_ok_and(|mtu| mtu < need) {
                let found =
                    format!("the interface takes packets of {} bytes, but {need} are sent", route.mtu);
                notes.add(Check::Mtu, found, "set the interface's MTU to 1500");
            }
        }
    }
}

/// True if its answers come here.
pub(super) fn judge_replies(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    if let (Ok(route), Some(host)) = (&subject.route, subject.ip(0x20))
        && host != route.local
    {
        let found = format!("PA20 to PA23 = {host}, but this machine's address is {}", route.local);
        notes.add(Check::ReplyAddress, found, format!("set PA20 to PA23 to {}", route.local));
    }
    let Some(port) = subject.pa(0x24) else { return };
    match terms.frame_port {
        0 => {
            let found = format!("PA24 = {port}, but bind has port 0: another frame port at every start");
            let remedy = if port == 0 {
                "set PA24 and the port of bind to the same number, such as 8410".to_owned()
            } else {
                format!("set port {port} in bind")
            };
            notes.add(Check::FramePortFree, found, remedy);
        }
        own if own != port => {
            let found = format!("PA24 = {port}, but the frame port is {own}");
            notes.add(Check::ReplyPort, found, format!("set PA24 = {own}, or port {port} in bind"));
        }
        _ => {}
    }
}
