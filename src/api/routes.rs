//! All routes, and from them the description that is served: what is not here is neither served nor described.

use std::sync::Arc;

use axum::middleware::from_fn_with_state;
use axum::routing::{get, post, put};
use utoipa::openapi::path::{Operation, Parameter, ParameterBuilder, ParameterIn, PathItem};
use utoipa::openapi::response::ResponseBuilder;
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{Content, OpenApi, Ref, RefOr, Required};
use utoipa::{OpenApi as _, ToSchema as _};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::problem::{PROBLEM_JSON, ProblemBody};
use super::shared::Shared;
use super::{
    controllers, cues, fleet, fleet_cues, fleet_wishes, gate, history, live, playlist, recordings, reports,
    service, settings, show, status,
};
use crate::control::Code;

/// What can be said of the whole.
#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "kinocue",
        description = "Control of a hall with motion seats. Not a safety device: the emergency stop is hard-wired. Every \
            change replies with the state that it led to, every refusal with a problem (RFC 9457). The control \
            socket has the role engineer; over TCP send Authorization: Bearer TOKEN. Replies carry X-Kinocue-Time, in Unix \
            milliseconds, as the clock for X-Kinocue-Sent."
    ),
    components(schemas(ProblemBody<'static>, Code))
)]
struct Document;

/// The routes, still without what they share, and their description.
pub(super) fn routes() -> (axum::Router<Arc<Shared>>, OpenApi) {
    let router = OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(service::health))
        .routes(routes!(service::ready))
        .routes(routes!(service::figures))
        .routes(routes!(service::document))
        .routes(routes!(status::status))
        .routes(routes!(status::who))
        .routes(routes!(status::events))
        .routes(routes!(show::home))
        .routes(routes!(show::load))
        .routes(routes!(show::arm))
        .routes(routes!(show::disarm))
        .routes(routes!(show::go))
        .routes(routes!(show::pause))
        .routes(routes!(show::resume))
        .routes(routes!(show::seek))
        .routes(routes!(show::stop))
        .routes(routes!(show::park))
        .routes(routes!(show::clear))
        .routes(routes!(settings::trim))
        .routes(routes!(status::sync))
        .routes(routes!(settings::source))
        .routes(routes!(settings::levels))
        .routes(routes!(settings::preset))
        .routes(routes!(settings::preflight))
        .routes(routes!(settings::test))
        .routes(routes!(settings::reload))
        .routes(routes!(controllers::all))
        .routes(routes!(controllers::one))
        .routes(routes!(controllers::enable))
        .routes(routes!(controllers::disable))
        .routes(routes!(playlist::all))
        .routes(routes!(playlist::choose))
        .routes(routes!(playlist::select))
        .routes(routes!(cues::all))
        .routes(routes!(cues::one, cues::upload))
        .routes(routes!(cues::curve))
        .routes(routes!(reports::one))
        .routes(routes!(history::all))
        .routes(routes!(recordings::all))
        .routes(routes!(recordings::one, recordings::remove))
        .routes(routes!(recordings::picture))
        .routes(routes!(recordings::mark))
        .routes(routes!(recordings::dump));
    let (router, document) = router.split_for_parts();
    // OpenAPI has no words for a WebSocket; docs/http.md has.
    let router = router.route(gate::LIVE, get(live::live));
    (router.fallback(service::page).method_not_allowed_fallback(service::wrong_method), completed(document))
}

/// The routes of the fleet socket, which has these alone.
pub(super) fn of_fleet() -> axum::Router<Arc<Shared>> {
    axum::Router::new()
        .route("/api/v1/fleet/status", get(fleet::status))
        .route("/api/v1/fleet/order", post(fleet::order))
        .route("/api/v1/fleet/clock", post(fleet::clock))
        .route("/api/v1/fleet/journal", post(fleet::journal))
        .route("/api/v1/fleet/wish", get(fleet_wishes::kept).put(fleet_wishes::wish))
        .route("/api/v1/fleet/cues/{id}", put(fleet_cues::take))
        .route("/api/v1/status", get(status::status))
        .route("/api/v1/cues", get(cues::all))
        .fallback(service::nothing)
        .method_not_allowed_fallback(service::wrong_method)
}

/// Adds what holds of every route.
fn completed(mut document: OpenApi) -> OpenApi {
    for (path, item) in &mut document.paths.paths {
        describe(path, item);
    }
    let token = SecurityScheme::Http(Http::new(HttpAuthScheme::Bearer));
    document.components.get_or_insert_default().add_security_scheme("token", token);
    document.security = Some(vec![SecurityRequirement::new("token", [""; 0])]);
    document
}

/// The whole: routes behind the gate.
pub(super) fn guarded(router: axum::Router<Arc<Shared>>, shared: Arc<Shared>) -> axum::Router {
    router.layer(from_fn_with_state(Arc::clone(&shared), gate::gate)).with_state(shared)
}

fn describe(path: &str, item: &mut PathItem) {
    let changes = [&mut item.post, &mut item.put].into_iter().flatten();
    changes.for_each(|operation| {
        let headers = [
            header(
                "X-Kinocue-Sent",
                "When it was asked, unix milliseconds; commands that would move seats are refused if it is too old.",
            ),
            header(
                "Idempotency-Key",
                "A second POST with the same key does nothing, and gets the same reply.",
            ),
        ];
        operation.parameters.get_or_insert_default().extend(headers.map(RefOr::T));
    });
    let all = [
        ("get", "What was asked for", &mut item.get),
        ("post", "It was done", &mut item.post),
        ("put", "It was done", &mut item.put),
        ("delete", "It was done", &mut item.delete),
    ];
    for (method, came, operation) in all {
        let Some(operation) = operation else { continue };
        // The names of our functions are not those of programs that are made of this.
        let words = path.trim_start_matches("/api/v1").split(|sign: char| !sign.is_ascii_alphanumeric());
        let name = std::iter::once(method).chain(words.filter(|word| !word.is_empty()));
        operation.operation_id = Some(name.collect::<Vec<_>>().join("_"));
        may_fail(operation);
        for reply in operation.responses.responses.values_mut() {
            if let RefOr::T(reply) = reply
                && reply.description.is_empty()
            {
                came.clone_into(&mut reply.description);
            }
        }
    }
}

fn may_fail(operation: &mut Operation) {
    let schema = Ref::from_schema_name(ProblemBody::name());
    let problem = ResponseBuilder::new()
        .description("Why it was not done")
        .content(PROBLEM_JSON, Content::new(Some(schema)))
        .build();
    operation.responses.responses.insert("default".to_owned(), RefOr::T(problem));
}

fn header(name: &str, description: &str) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(description))
        .schema(Some(ObjectBuilder::new().schema_type(Type::String)))
        .build()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    #[test]
    fn every_reference_of_the_description_leads_somewhere() {
        let document = serde_json::to_value(routes().1).unwrap();
        let mut seen = 0;
        let mut todo = vec![&document];
        while let Some(value) = todo.pop() {
            match value {
                Value::Object(map) => {
                    if let Some(Value::String(reference)) = map.get("$ref") {
                        let place = reference.strip_prefix('#').unwrap();
                        assert!(document.pointer(place).is_some(), "{reference}");
                        seen += 1;
                    }
                    todo.extend(map.values());
                }
                Value::Array(values) => todo.extend(values),
                _ => {}
            }
        }
        assert!(seen > 50, "{seen}");
    }
}
