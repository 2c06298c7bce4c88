//! Faults of real links and machines: two network namespaces that a cable joins, `kinocue sim` in one, `kinocue serve` in the other,
//! and what goes wrong between them done to the interfaces, queues, addresses and neighbour tables of the kernel. The seats are judged
//! by what the simulators were sent; what is told, by the statuses of the service. Nothing leaves the namespaces, and root is not needed.

#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../common/process.rs"]
mod process;
#[path = "../common/programs.rs"]
mod programs;
#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../common/serving.rs"]
mod serving;
#[path = "../common/statuses.rs"]
mod statuses;

mod answers;
mod broadcast;
mod cable;
mod forger;
mod hall;
mod late;
mod machine;
mod net;
