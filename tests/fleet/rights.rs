//! What the key of a hall, or of a desk, may at the engine, and what not.

use std::fs;

use async_nats::{Client, ConnectOptions, Event};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::time::timeout;

use crate::fleet::Engine;
use crate::process::PATIENCE;

/// A member that says whatever it is told to.
struct Member {
    client: Client,
    refused: UnboundedReceiver<String>,
}

impl Member {
    async fn connect(engine: &Engine, key: &str, inbox: &str) -> Self {
        let seed = fs::read_to_string(engine.path(&format!("fleet/{key}"))).unwrap().trim().to_owned();
        let (tell, refused) = unbounded_channel();
        let options =
            ConnectOptions::with_nkey(seed).custom_inbox_prefix(inbox).event_callback(move |event| {
                if let Event::ServerError(error) = event {
                    let _ = tell.send(error.to_string());
                }
                async {}
            });
        Self { client: options.connect(engine.url()).await.unwrap(), refused }
    }

    /// Whether it may publish there.
    async fn may_publish(&mut self, subject: &str) -> bool {
        self.client.publish(subject.to_owned(), "x".into()).await.unwrap();
        self.is_let().await
    }

    async fn may_hear(&mut self, subject: &str) -> bool {
        let _heard = self.client.subscribe(subject.to_owned()).await.unwrap();
        self.is_let().await
    }

    /// The engine refuses in order: once it has refused what nobody may, it has told of what came before.
    async fn is_let(&mut self) -> bool {
        self.client.publish("kc.nobody", "x".into()).await.unwrap();
        self.client.flush().await.unwrap();
        let mut is_let = true;
        loop {
            let why = timeout(PATIENCE, self.refused.recv()).await.unwrap().unwrap();
            if why.contains("kc.nobody") {
                return is_let;
            }
            is_let = false;
        }
    }
}

#[test]
fn a_stolen_key_of_a_hall_tells_of_that_hall_alone_and_hears_no_other() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let work = async {
            let mut hall = Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1").await;
            for may in ["kc.status.berlin.h1", "kc.log.berlin.h1", "$JS.hub.API.$KV.kc_seen.berlin.h1"] {
                assert!(hall.may_publish(may).await, "{may}");
            }
            for may_not in [
                "kc.status.berlin.h2",
                "kc.log.berlin.h2",
                "kc.cmd.berlin.h2.office.pause",
                "kc.cmd.berlin.h1.office.pause",
                "kc.stop.berlin.h2.office",
                "kc.stop.berlin.all.office",
                "$KV.kc_seen.berlin.h2",
                "$JS.hub.API.$KV.kc_seen.berlin.h2",
                "$JS.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.PURGE.kc_log",
                "$JS.hub.API.STREAM.INFO.kc_log",
                "$JS.hub.API.DIRECT.GET.kc_log.kc.log.berlin.h2",
                "$JS.hub.API.CONSUMER.CREATE.kc_log",
            ] {
                assert!(!hall.may_publish(may_not).await, "{may_not}");
            }
            for may in ["kc.cmd.berlin.h1.*.*", "kc.stop.berlin.h1.*", "kc.stop.berlin.all.*"] {
                assert!(hall.may_hear(may).await, "{may}");
            }
            for may_not in [
                "kc.cmd.berlin.h2.*.*",
                "kc.status.berlin.h2",
                "kc.>",
                "_INBOX_hall.berlin.h2.>",
                "_INBOX_desk.office.>",
                ">",
            ] {
                assert!(!hall.may_hear(may_not).await, "{may_not}");
            }
            let mut desk = Member::connect(&engine, "office/desk.nk", "_INBOX_desk.office").await;
            for may in ["kc.cmd.berlin.h1.office.pause", "kc.stop.berlin.all.office"] {
                assert!(desk.may_publish(may).await, "{may}");
            }
            for may_not in [
                "kc.cmd.berlin.h1.boss.pause",
                "kc.stop.berlin.h1.boss",
                "kc.status.berlin.h1",
                "kc.log.berlin.h1",
                "$JS.hub.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.PURGE.kc_log",
            ] {
                assert!(!desk.may_publish(may_not).await, "{may_not}");
            }
            let stranger = ConnectOptions::new().connect(engine.url()).await;
            assert!(stranger.is_err(), "nobody comes in without a key");
        };
        timeout(PATIENCE, work).await.unwrap();
    });
}
