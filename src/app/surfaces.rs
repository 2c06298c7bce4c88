//! The surfaces of the daemon: the HTTP API with the console, the stop socket, buttons, OSC and the text port. They outlive the hall
//! that is kept behind them.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::Builder;

use tokio::runtime;
use tokio::sync::watch;

use super::buttons::{Buttons, PadTable};
use super::recorder::RecordPlaces;
use crate::api::{self, ApiError, Pages, ServingThread, StopSocket, fleet_stop_socket, stop_socket};
use crate::config::{Config, OscPort, TextPort};
use crate::control::{AwaitedPorts, Handle};
use crate::library::Library;
use crate::log::{Line, Log, Priority};
use crate::osc::{self, Counts};
use crate::playlist::Shelf;
use crate::text_port;

/// Where the sockets of this machine are.
#[derive(Debug, Clone)]
pub(crate) struct Sockets {
    /// The control socket.
    pub(crate) control: PathBuf,
    /// The one that takes a stop alone.
    pub(crate) stop: PathBuf,
    /// That of whoever carries the letters of a fleet; served only in a hall that has one. The one for its stops is beside it.
    pub(crate) fleet: PathBuf,
}

/// The name of the socket for stops of a fleet.
const FLEET_STOP: &str = "fleet-stop.sock";

/// Why a surface does not open.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum SurfaceError {
    /// The API, or the stop socket.
    #[error(transparent)]
    Api(#[from] ApiError),
    /// There is no thread for a pad.
    #[error("the system refused a thread for [buttons]")]
    Buttons(#[source] io::Error),
    /// There is no thread, or no timer.
    #[error("the system refused the ports for OSC and text")]
    System(#[source] io::Error),
}

/// All surfaces, open until this is dropped.
#[derive(Debug)]
pub(crate) struct Surfaces {
    // The stop goes last.
    ports: Option<ServingThread>,
    osc: Option<Arc<Counts>>,
    awaited: AwaitedPorts,
    buttons: Buttons,
    api: api::Running,
    fleet_stop: Option<StopSocket>,
    stop: StopSocket,
}

impl Surfaces {
    /// Opens them; the stop first. Ports on the network that cannot be had yet are opened once they can.
    ///
    /// # Errors
    /// Why a socket of this machine does not open.
    pub(crate) fn open(
        config: &Config,
        sockets: &Sockets,
        handle: &Handle,
        library: Library,
        places: &RecordPlaces,
        pages: Pages,
        log: &Log,
    ) -> Result<Self, SurfaceError> {
        let stop = stop_socket(&sockets.stop, handle.clone())?;
        let fleet_stop = config.fleet.as_ref().map(|_| {
            let path = sockets.fleet.with_file_name(FLEET_STOP);
            fleet_stop_socket(&path, handle.clone())
        });
        let fleet_stop = fleet_stop.transpose()?;
        let setup = api::Setup {
            config: config.api.clone(),
            socket: sockets.control.clone(),
            handle: handle.clone(),
            library,
            playlists: Shelf::new(&config.playlists()),
            journal: config.log.dir.clone(),
            recordings: places.recordings.clone(),
            pages,
            log: log.clone(),
        };
        let awaited = AwaitedPorts::default();
        let fleet = config.fleet.as_ref().map(|fleet| (fleet, &*sockets.fleet));
        let api = api::start_with(setup, fleet, &awaited)?;
        let counts = config.osc.as_ref().map(|_| Arc::<Counts>::default());
        let osc = config.osc.clone().zip(counts.clone());
        let is_wanted = osc.is_some() || config.text.is_some();
        let gear = Gear { osc, text: config.text.clone(), handle: handle.clone(), awaited: awaited.clone() };
        let ports = is_wanted.then(|| show_control(gear, log.clone())).transpose()?;
        let buttons = Buttons::read(config, handle, log).map_err(SurfaceError::Buttons)?;
        Ok(Self { ports, osc: counts, awaited, buttons, api, fleet_stop, stop })
    }

    /// Where the API listens over TCP.
    #[must_use]
    pub(crate) fn addresses(&self) -> &[std::net::SocketAddr] {
        self.api.addresses()
    }

    /// Takes tokens and keys of a configuration that is in effect now.
    pub(crate) fn take_tokens(&self, config: &Config) {
        self.api.set_tokens(&config.api.tokens);
        self.api.set_fleet(config.fleet.as_ref());
    }

    /// What has come to the port for OSC, if there is one.
    pub(crate) fn osc_counts(&self) -> Option<Arc<Counts>> {
        self.osc.clone()
    }

    /// The ports that cannot be had yet.
    pub(crate) fn awaited(&self) -> AwaitedPorts {
        self.awaited.clone()
    }

    /// How the pads are, if there are any.
    pub(crate) fn pads(&self) -> Option<PadTable> {
        self.buttons.table()
    }

    /// Closes them in turn, those that stop last.
    pub(crate) fn close(self) {
        let Self { ports, api, buttons, fleet_stop, stop, .. } = self;
        drop(ports);
        drop(api);
        drop(buttons);
        drop(fleet_stop);
        drop(stop);
    }
}

/// The ports of show-control gear.
struct Gear {
    osc: Option<(OscPort, Arc<Counts>)>,
    text: Option<TextPort>,
    handle: Handle,
    awaited: AwaitedPorts,
}

/// Serves them on a thread of their own.
fn show_control(gear: Gear, log: Log) -> Result<ServingThread, SurfaceError> {
    let (closing, mut closed) = watch::channel(false);
    let runtime =
        runtime::Builder::new_current_thread().enable_all().build().map_err(SurfaceError::System)?;
    let Gear { osc, text, handle, awaited } = gear;
    let (of_osc, of_text) = (handle.clone(), handle);
    let open_osc = move |(config, counts): &(OscPort, Arc<Counts>)| {
        osc::open(config, of_osc.clone(), Arc::clone(counts))
    };
    let open_text = move |config: &TextPort| text_port::open(config, of_text.clone());
    let osc_now = osc.as_ref().and_then(|osc| awaited.try_open("osc", || open_osc(osc)));
    let text_now = text.as_ref().and_then(|text| awaited.try_open("text", || open_text(text)));
    let run = move || {
        runtime.block_on(async move {
            let fail = |what: &str, error: io::Error| {
                let text = format!("the port for {what} has failed: {error}; restart the service");
                log.say(Line::new(Priority::Error, "port", text));
            };
            let osc = async {
                let Some(osc) = osc else { return };
                let opened = match osc_now {
                    Some(opened) => opened,
                    None => awaited.open("osc", || open_osc(&osc)).await,
                };
                let Err(error) = opened.serve().await;
                fail("OSC", error);
            };
            let text = async {
                let Some(text) = text else { return };
                let opened = match text_now {
                    Some(opened) => opened,
                    None => awaited.open("text", || open_text(&text)).await,
                };
                let Err(error) = opened.serve().await;
                fail("text", error);
            };
            tokio::select! {
                _ = closed.wait_for(|closing| *closing) => {}
                () = async { tokio::join!(osc, text); std::future::pending::<()>().await } => {}
            }
        });
    };
    let thread = Builder::new().name("ports".to_owned()).spawn(run).map_err(SurfaceError::System)?;
    Ok(ServingThread::new(closing, thread))
}
