//! Conditions on axes: `bits >= 2 || rounding == "stochastic"`, in the expression language of Rhai.

use rhai::{AST, Dynamic, Engine, Scope};

use super::SweepError;
use super::axis::Value;

/// Steps one condition may take: far more than an expression needs, and an end to one that never ends.
const STEPS_MAX: u64 = 100_000;

/// Conditions, compiled.
pub(super) struct Filter {
    engine: Engine,
    conditions: Vec<(String, AST)>,
}

impl std::fmt::Debug for Filter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.conditions.iter().map(|(text, _)| text)).finish()
    }
}

fn wrong(text: &str, error: &dyn std::fmt::Display, names: &[&str]) -> SweepError {
    SweepError::Filter { text: text.into(), error: error.to_string(), names: names.join(", ") }
}

fn scope<'a>(names: &[&'a str], values: &[Value]) -> Scope<'a> {
    let mut scope = Scope::new();
    for (name, value) in names.iter().zip(values) {
        let value = match value {
            Value::Whole(value) => Dynamic::from(*value),
            Value::Real(value) => Dynamic::from(*value),
            Value::Flag(value) => Dynamic::from(*value),
            Value::Text(value) => Dynamic::from(value.clone()),
        };
        scope.push_constant_dynamic(*name, value);
    }
    scope
}

impl Filter {
    /// Compiles conditions on columns of these names.
    pub(super) fn new(texts: &[String], names: &[&str]) -> Result<Self, SweepError> {
        let mut engine = Engine::new();
        engine.set_max_operations(STEPS_MAX).set_strict_variables(true);
        // nothing is known of the values yet, and the compiler shall not count on them
        engine.set_optimization_level(rhai::OptimizationLevel::None);
        let known = scope(names, &vec![Value::Whole(0); names.len()]);
        let compile = |text: &String| match engine.compile_expression_with_scope(&known, text) {
            Ok(tree) => Ok((text.clone(), tree)),
            Err(error) => Err(wrong(text, &error, names)),
        };
        let conditions = texts.iter().map(compile).collect::<Result<_, _>>()?;
        Ok(Self { engine, conditions })
    }

    /// Whether values meet every condition.
    pub(super) fn passes(&self, names: &[&str], values: &[Value]) -> Result<bool, SweepError> {
        let mut scope = scope(names, values);
        for (text, tree) in &self.conditions {
            let found = self.engine.eval_ast_with_scope::<bool>(&mut scope, tree);
            if !found.map_err(|error| wrong(text, &error, names))? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passes(text: &str) -> Result<bool, String> {
        let names = ["bits", "rate", "rule"];
        let values = [Value::Whole(4), Value::Real(2.0), Value::Text("ed".into())];
        Filter::new(&[text.into()], &names)
            .and_then(|filter| filter.passes(&names, &values))
            .map_err(|e| e.to_string())
    }

    #[test]
    fn conditions_compare_numbers_and_words() {
        for (text, wanted) in [
            ("bits >= 4 && rule == \"ed\"", true),
            ("bits > 4 || rule != \"ed\"", false),
            ("bits * 2 == 8", true),
            ("rate < bits", true),
            ("rule in [\"dfa\", \"bp\"]", false),
        ] {
            assert_eq!(passes(text), Ok(wanted), "{text}");
        }
    }

    #[test]
    fn mistakes_show_the_condition_and_the_names() {
        for text in ["bit > 1", "bits >", "bits + 1", "bits = 3", "while true {}"] {
            let error = passes(text).unwrap_err();
            assert!(error.contains(text) && error.contains("bits, rate, rule"), "{text}: {error}");
        }
    }
}
