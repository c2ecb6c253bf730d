//! The one table of what can be asked over HTTP: the router and the description are made of it.

use crate::access::Right;
use crate::api::{artwork, jobs, queue, requests, runs, state, system};
use crate::context::Context;
use crate::live;
use axum::Router;
use axum::http::Method;
use axum::routing::{MethodRouter, delete, get, post};
use schemars::{JsonSchema, Schema, SchemaGenerator};

/// How the schema of a type is made.
pub type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

/// What a request brings.
#[derive(Clone, Copy)]
pub enum Takes {
    /// Nothing.
    Nothing,
    /// JSON.
    Json(SchemaOf),
    /// A file.
    File,
}

/// What it is answered with.
#[derive(Clone, Copy)]
pub enum Gives {
    /// JSON.
    Json(SchemaOf),
    /// Something of this content type.
    Other(&'static str),
    /// A connection for messages.
    Messages,
    /// The way to another page.
    Elsewhere,
}

/// A number or name in the query.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub text: &'static str,
}

/// Something that can be asked.
pub struct Route {
    /// The method.
    pub method: Method,
    /// The path; `{…}` stands for a part of it.
    pub path: &'static str,
    /// Its name in programs that are made of the description.
    pub name: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// What whoever asks must be allowed to do; `None` for everybody.
    pub needs: Option<Right>,
    /// What stands in the query.
    pub query: &'static [Parameter],
    /// What it brings.
    pub takes: Takes,
    /// What it is answered with.
    pub gives: Gives,
    handler: MethodRouter<Context>,
}

impl std::fmt::Debug for Route {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} {}", self.method, self.path)
    }
}

impl Route {
    fn new(
        (method, path): (Method, &'static str),
        name: &'static str,
        summary: &'static str,
        gives: Gives,
        handler: MethodRouter<Context>,
    ) -> Self {
        let needs = if method == Method::GET { Right::Watch } else { Right::Operate };
        let (takes, query): (_, &[Parameter]) = (Takes::Nothing, &[]);
        Self { method, path, name, summary, needs: Some(needs), query, takes, gives, handler }
    }

    fn takes(self, takes: Takes) -> Self {
        Self { takes, ..self }
    }

    fn query(self, query: &'static [Parameter]) -> Self {
        Self { query, ..self }
    }

    fn for_everybody(self) -> Self {
        Self { needs: None, ..self }
    }
}

fn json<T: JsonSchema>() -> Gives {
    Gives::Json(schema::<T>)
}

fn body<T: JsonSchema>() -> Takes {
    Takes::Json(schema::<T>)
}

fn schema<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}

/// Everything that can be asked, in the order of the description.
pub fn table() -> Vec<Route> {
    let get_at = |path| (Method::GET, path);
    let post_at = |path| (Method::POST, path);
    let name_of_file =
        &[Parameter { name: "name", text: "The name of the file, with its ending." }];
    let token = &[Parameter { name: "token", text: "A token of the server's token file." }];
    vec![
        Route::new(
            get_at("/api/v1/status"),
            "status",
            "What the pipeline is doing.",
            json::<operator::Status>(),
            get(state::status),
        ),
        Route::new(
            get_at("/api/v1/machine"),
            "machine",
            "The machine: its axes, its area, its inputs and outputs.",
            json::<crate::machine_facts::MachineFacts>(),
            get(state::machine),
        ),
        Route::new(
            get_at("/api/v1/faults"),
            "faults",
            "The newest faults with what to do about each, the last one last.",
            json::<Vec<state::ToldFault>>(),
            get(state::faults),
        ),
        Route::new(
            get_at("/api/v1/latency"),
            "latency",
            "Latencies of each hop of the control cycle since this server joined the pipeline.",
            json::<crate::hub::LatencyReport>(),
            get(state::latency),
        ),
        Route::new(
            get_at("/api/v1/signals"),
            "signals",
            "The signals that the scope can show.",
            json::<Vec<crate::signals::SignalName>>(),
            get(state::signals),
        ),
        Route::new(
            get_at("/api/v1/artwork"),
            "artwork",
            "What the job under way is to mark, thinned to be drawn.",
            json::<artwork::ArtworkAnswer>(),
            get(artwork::artwork),
        ),
        Route::new(
            post_at("/api/v1/requests/{verb}"),
            "request",
            "Asks the machine for something. A request that it refuses is answered with 200 too: `accepted` says.",
            json::<operator::VerbReply>(),
            post(requests::request),
        )
        .takes(body::<requests::Arguments>()),
        Route::new(
            post_at("/api/v1/jobs"),
            "upload",
            "Uploads a job file of at most 64 MiB.",
            json::<crate::spool::SpooledFile>(),
            post(jobs::upload),
        )
        .takes(Takes::File)
        .query(name_of_file),
        Route::new(
            get_at("/api/v1/jobs"),
            "jobs",
            "The files that were uploaded, the newest first.",
            json::<Vec<crate::spool::SpooledFile>>(),
            get(jobs::list),
        ),
        Route::new(
            (Method::DELETE, "/api/v1/jobs/{id}"),
            "remove",
            "Removes an uploaded file that no job in the queue needs.",
            json::<jobs::Nothing>(),
            delete(jobs::remove),
        ),
        Route::new(
            post_at("/api/v1/jobs/{id}/check"),
            "check",
            "Plans a job, and says whether the machine can do it and what it comes to.",
            json::<crate::preview::CheckAnswer>(),
            post(jobs::check),
        )
        .takes(body::<jobs::Changes>()),
        Route::new(
            post_at("/api/v1/jobs/{id}/preview"),
            "preview",
            "Reads a job, and gives what it would mark, thinned to be drawn.",
            json::<crate::outline::Strokes>(),
            post(jobs::preview),
        )
        .takes(body::<jobs::Changes>()),
        Route::new(
            post_at("/api/v1/jobs/{id}/submit"),
            "submit",
            "Puts a job into the queue.",
            json::<jobs::Number>(),
            post(jobs::submit),
        )
        .takes(body::<jobs::Changes>()),
        Route::new(
            get_at("/api/v1/queue"),
            "queue",
            "The job under way, those that wait, and the newest that have ended.",
            json::<operator::Queue>(),
            get(queue::queue),
        ),
        Route::new(
            post_at("/api/v1/queue/hold"),
            "hold_queue",
            "Begins no more of the jobs that wait; the one under way goes on.",
            json::<operator::Queue>(),
            post(queue::hold),
        ),
        Route::new(
            post_at("/api/v1/queue/start"),
            "start_queue",
            "Begins the jobs that wait, one after the other.",
            json::<operator::Queue>(),
            post(queue::start),
        ),
        Route::new(
            post_at("/api/v1/queue/{number}/cancel"),
            "cancel",
            "Takes a job back: stops it if it is under way, and else takes it out of the queue.",
            json::<jobs::Nothing>(),
            post(queue::cancel),
        ),
        Route::new(
            post_at("/api/v1/queue/{number}/move"),
            "move",
            "Puts a job that waits at another place of the queue.",
            json::<jobs::Nothing>(),
            post(queue::move_to),
        )
        .takes(body::<queue::Place>()),
        Route::new(
            post_at("/api/v1/queue/{number}/repeat"),
            "repeat",
            "Puts a job into the queue once more, under a new number.",
            json::<jobs::Number>(),
            post(queue::repeat),
        ),
        Route::new(
            get_at("/api/v1/runs"),
            "runs",
            "The jobs that have ended, the newest first, with the files that each left.",
            json::<Vec<runs::Run>>(),
            get(runs::list),
        ),
        Route::new(
            get_at("/api/v1/runs/{number}/{file}"),
            "run_file",
            "A file of a run: report.html, summary.json or path.svg.",
            Gives::Other("application/octet-stream"),
            get(runs::file),
        ),
        Route::new(
            get_at("/api/v1/live"),
            "live",
            "Opens a WebSocket: status, tool path, queue, latencies and events as they come; jog and scope.",
            Gives::Messages,
            get(live::live),
        ),
        Route::new(
            get_at("/metrics"),
            "metrics",
            "Numbers for Prometheus.",
            Gives::Other("text/plain"),
            get(system::metrics),
        ),
        Route::new(
            get_at("/openapi.json"),
            "openapi",
            "This description.",
            Gives::Other("application/json"),
            get(system::openapi),
        ),
        Route::new(
            get_at("/login"),
            "login",
            "Gives a browser a cookie for a token, and leads to the page.",
            Gives::Elsewhere,
            get(system::login),
        )
        .for_everybody()
        .query(token),
    ]
}

/// The router of the table.
pub fn router() -> Router<Context> {
    table().into_iter().fold(Router::new(), |router, route| {
        let handler = route.handler.route_layer(axum::middleware::from_fn_with_state(
            route.needs,
            crate::api::guard::require,
        ));
        router.route(route.path, handler)
    })
}
