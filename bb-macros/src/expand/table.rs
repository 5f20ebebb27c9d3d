//! Declarations as tables of constants.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

/// Number of values in one constant: rustc's time for one grows with its square.
const SIZE: usize = 16;

/// `static __SENSORS: [SensorDeclaration; 20] = join(&[&__SENSORS_0, &__SENSORS_1]);`
pub(super) fn array(name: &str, kind: TokenStream, values: Vec<TokenStream>) -> TokenStream {
    let (array, count) = (format_ident!("{name}"), values.len());
    if count <= SIZE {
        return quote!(static #array: [#kind; #count] = [#(#values),*];);
    }
    let parts = values.chunks(SIZE).enumerate().map(|(number, values)| {
        let (part, count) = (format_ident!("{name}_{number}"), values.len());
        quote!(const #part: [#kind; #count] = [#(#values),*];)
    });
    let names = (0..count.div_ceil(SIZE)).map(|number| format_ident!("{name}_{number}"));
    quote! {
        #(#parts)*
        static #array: [#kind; #count] = __private::join(&[#(&#names),*]);
    }
}
