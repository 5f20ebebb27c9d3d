//! The aliases for the inputs of estimators.

use super::Wiring;
use crate::expand::islands;
use crate::expand::part::Part;
use crate::expand::types::Types;
use crate::model::{EstimatorId, PublisherId, Table};
use crate::verify::Verified;
use proc_macro2::{Ident, TokenStream};
use quote::{ToTokens as _, format_ident, quote};
use std::collections::HashMap;

/// The aliases for an input: each is named after the first input that it fits, and declared there.
pub(super) struct Input {
    pub(super) source: PublisherId,
    /// Field of the input.
    pub(super) field: Ident,
    pub(super) taken: Ident,
    pub(super) declares_field: bool,
    /// Constant that says whether that payload and its publisher's are known.
    pub(super) known: Ident,
    pub(super) declares_known: bool,
}

/// The inputs of each estimator. Those of the same name and type share their aliases.
pub(super) fn inputs(verified: &Verified<'_>, types: &Types<'_>) -> Table<EstimatorId, Vec<Input>> {
    let robot = verified.robot;
    let (mut fields, mut knowns) = (HashMap::new(), HashMap::new());
    robot.estimators.map(|id| {
        let (part, estimator) = (Part::Estimator(id), &robot.estimators[id]);
        let names = estimator.inputs.iter().map(|input| Some(crate::names::text(&input.name)));
        let names = names.chain(estimator.is_nested().then_some(None));
        let inputs = names.zip(islands::sources(verified, id)).map(|(name, source)| {
            let suffix = name.as_ref().map_or_else(String::new, |name| format!("__{name}"));
            let own = format!("{}{suffix}", types.name_of(part));
            let field: &String = fields.entry((types.first(part), name)).or_insert_with(|| own.clone());
            let payload = types.payload(source).into_token_stream().to_string();
            let known: &String = knowns.entry((payload, field.clone())).or_insert_with(|| own.clone());
            Input {
                source,
                field: format_ident!("__input__{field}"),
                taken: format_ident!("__taken__{field}"),
                declares_field: *field == own,
                known: format_ident!("__known__{known}"),
                declares_known: *known == own,
            }
        });
        inputs.collect()
    })
}

impl Wiring<'_> {
    pub(super) fn input(&self, id: EstimatorId, input: Option<usize>) -> &Input {
        &self.inputs[id][input.unwrap_or_default()]
    }

    /// The aliases for an input that are not declared for an earlier one.
    pub(super) fn aliases(&self, id: EstimatorId, number: usize, input: &Input) -> Option<TokenStream> {
        if !input.declares_field && !input.declares_known {
            return None;
        }
        let Input { source, field, taken, known, .. } = input;
        let is_nested = self.types.model().estimators[id].is_nested();
        let fields = input.declares_field.then(|| {
            let found = self.types.input_field(id, (!is_nested).then_some(number));
            let of = self.types.estimator_input(id);
            quote! {
                type #field = #found;
                type #taken = <#field as __private::TakenAt<#of>>::Payload;
            }
        });
        let knowns = input.declares_known.then(|| {
            let payload = self.types.payload(*source);
            quote!(type #known = __private::BothKnown<{ __private::both_known::<#payload, #taken>() }>;)
        });
        Some(quote!(#fields #knowns))
    }
}
