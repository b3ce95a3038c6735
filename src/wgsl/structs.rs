//! Checks that structs which Rust and WGSL both spell out lie alike in memory; for the lab's shaders, too.

pub(crate) fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).expect("the shader parses")
}

/// Byte offsets of the members of a WGSL struct, by name, and its size.
pub(crate) fn layout(source: &str, name: &str) -> (Vec<(String, usize)>, usize) {
    let module = parse(source);
    let (members, span) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some(name))
        .and_then(|(_, t)| match &t.inner {
            naga::TypeInner::Struct { members, span } => Some((members, *span)),
            _ => None,
        })
        .expect("the shader has a struct of this name");
    let offsets = members.iter().map(|m| {
        let name = m.name.clone().expect("members have names");
        (name, m.offset as usize)
    });
    (offsets.collect(), span as usize)
}

/// Asserts that the fields of `$rust` lie where the shader has the members of the same names.
macro_rules! assert_layout {
    ($source:expr, $wgsl:literal, $rust:ty { $($field:ident),+ $(,)? }) => {
        let (members, size) = $crate::wgsl::layout($source, $wgsl);
        let fields = vec![$((stringify!($field).to_string(), std::mem::offset_of!($rust, $field))),+];
        assert_eq!(fields, members, "{}", $wgsl);
        assert_eq!(size_of::<$rust>(), size, "size of {}", $wgsl);
    };
}

pub(crate) use assert_layout;
