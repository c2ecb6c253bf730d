//! The description of the interface for programs, OpenAPI 3.1, made of the table of routes.

use crate::access::{PROGRAM_HEADER, Right};
use crate::api::requests::VERBS;
use crate::routes::{Gives, Route, Takes, table};
use schemars::generate::{SchemaGenerator, SchemaSettings};
use serde_json::{Map, Value, json};

/// The description.
pub fn document() -> Value {
    let settings = SchemaSettings::draft2020_12()
        .with(|settings| settings.definitions_path = "/components/schemas".into());
    let mut generator = settings.into_generator();
    let mut paths = Map::new();
    let failed = generator.subschema_for::<crate::api::ErrorBody>();
    for route in table() {
        let operation = operation(&route, &mut generator, failed.as_value());
        let methods = paths.entry(route.path).or_insert_with(|| json!({}));
        methods[route.method.as_str().to_ascii_lowercase()] = operation;
    }
    json!({
        "openapi": "3.1.1",
        "info": {
            "title": "Graver",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "A running laser marking machine: status, requests, jobs. SI units, angles in radians. \
                A request that changes something must carry an Origin that is this server, an Authorization, or \
                the header X-Graver: 1.",
            "license": { "name": "MIT OR Apache-2.0" },
        },
        "servers": [{ "url": "/" }],
        "security": [{}, { "token": [] }],
        "paths": paths,
        "components": {
            "schemas": generator.take_definitions(true),
            "securitySchemes": { "token": {
                "type": "http",
                "scheme": "bearer",
                "description": "Not needed by the user of the pipeline on the same computer.",
            } },
        },
    })
}

fn operation(route: &Route, generator: &mut SchemaGenerator, failed: &Value) -> Value {
    let mut operation = json!({
        "operationId": route.name,
        "summary": route.summary,
        "parameters": parameters(route),
        "responses": responses(route, generator, failed),
    });
    match route.takes {
        Takes::Nothing => {}
        Takes::Json(schema) => {
            let schema = schema(generator);
            operation["requestBody"] =
                json!({ "content": { "application/json": { "schema": schema } } });
        }
        Takes::File => {
            operation["requestBody"] =
                json!({ "required": true, "content": { "application/octet-stream": {} } });
        }
    }
    operation["security"] = match route.needs {
        None => json!([{}]),
        Some(_) => json!([{}, { "token": [] }]),
    };
    if let Some(right) = route.needs {
        operation["x-right"] = json!(right);
    }
    operation
}

fn parameters(route: &Route) -> Vec<Value> {
    let parts = route.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = parts
        .map(|name| {
            let schema = match name {
                "verb" => json!({ "type": "string", "enum": VERBS.map(|(name, _)| name) }),
                "number" => json!({ "type": "integer", "minimum": 1 }),
                "file" => json!({ "type": "string", "enum": crate::api::runs::FILES }),
                _ => json!({ "type": "string" }),
            };
            json!({ "name": name, "in": "path", "required": true, "schema": schema })
        })
        .collect();
    parameters.extend(route.query.iter().map(|parameter| {
        json!({
            "name": parameter.name,
            "in": "query",
            "required": true,
            "description": parameter.text,
            "schema": { "type": "string" },
        })
    }));
    if route.needs == Some(Right::Operate) {
        parameters.push(json!({
            "name": PROGRAM_HEADER,
            "in": "header",
            "description": "Anything; needed without Origin and Authorization.",
            "schema": { "type": "string" },
        }));
    }
    parameters
}

fn responses(route: &Route, generator: &mut SchemaGenerator, failed: &Value) -> Value {
    let (code, done) = match route.gives {
        Gives::Json(schema) => {
            let schema = schema(generator);
            (
                "200",
                json!({ "description": "Done.",
                "content": { "application/json": { "schema": schema } } }),
            )
        }
        Gives::Other(kind) => ("200", json!({ "description": "Done.", "content": { kind: {} } })),
        Gives::Messages => ("101", json!({ "description": "Messages follow." })),
        Gives::Elsewhere => ("303", json!({ "description": "The page." })),
    };
    let failed = json!({ "description": "Why not.",
        "content": { "application/json": { "schema": failed } } });
    json!({ code: done, "default": failed })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::collections::BTreeSet;

    /// Every reference in a document.
    fn references(value: &Value, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(map) => {
                if let Some(Value::String(reference)) = map.get("$ref") {
                    found.insert(reference.clone());
                }
                map.values().for_each(|value| references(value, found));
            }
            Value::Array(list) => list.iter().for_each(|value| references(value, found)),
            _ => {}
        }
    }

    #[test]
    fn every_reference_leads_somewhere_and_every_schema_is_one() {
        let document = document();
        let mut found = BTreeSet::new();
        references(&document, &mut found);
        assert!(found.len() > 10, "{found:?}");
        for reference in found {
            let pointer = reference.strip_prefix('#').unwrap();
            assert!(document.pointer(pointer).is_some(), "{reference}");
        }
        for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
            assert!(jsonschema::meta::is_valid(schema), "{name}: {schema:#}");
        }
    }

    #[test]
    fn the_description_has_every_route_once_with_all_its_parts() {
        let document = document();
        let mut names = BTreeSet::new();
        for route in table() {
            let method = route.method.as_str().to_ascii_lowercase();
            let operation = &document["paths"][route.path][&method];
            assert_eq!(operation["operationId"], route.name, "{route:?}");
            assert!(names.insert(route.name), "{route:?}");
            let parameters = operation["parameters"].as_array().unwrap();
            let in_path = parameters.iter().filter(|it| it["in"] == "path").count();
            assert_eq!(in_path, route.path.matches('{').count(), "{route:?}");
            assert!(operation["responses"]["default"].is_object());
            assert!(route.summary.ends_with('.'), "{route:?}");
        }
    }
}
