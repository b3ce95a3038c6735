//! The numbers of a glTF file's accessors: of any component type, normalised or sparse, bounds checked.

use bytemuck::pod_read_unaligned as pod;
use gltf::accessor::sparse::IndexType;
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::View;

/// What is wrong and what is needed.
pub(super) type Problem = (String, &'static str);

/// The bytes of a file's buffers.
pub(super) struct Buffers(pub Vec<Vec<u8>>);

impl Buffers {
    /// The bytes of a buffer view, if it lies inside its buffer.
    pub fn view(&self, view: &View) -> Option<&[u8]> {
        let buffer = self.0.get(view.buffer().index())?;
        buffer.get(view.offset()..)?.get(..view.length())
    }

    /// The first `count` elements, each of `N` numbers; zeros where the accessor has no bytes.
    pub fn read<T: Copy, const N: usize>(
        &self,
        accessor: &Accessor,
        count: usize,
        convert: impl Fn(f64) -> T,
    ) -> Result<Vec<[T; N]>, Problem> {
        let (shape, kind) = (accessor.dimensions(), accessor.data_type());
        if shape.multiplicity() != N || matches!(shape, Dimensions::Mat2 | Dimensions::Mat3) {
            let needs = ["scalars", "", "VEC2", "VEC3", "VEC4"].get(N).copied();
            let got = format!("{shape:?} of {kind:?}").to_uppercase().replace(" OF ", " of ");
            return Err((got, needs.filter(|n| !n.is_empty()).unwrap_or("MAT4")));
        }
        if accessor.count() < count {
            return Err((format!("{} elements", accessor.count()), "one for each that is used"));
        }
        let most = match kind {
            _ if !accessor.normalized() => 1.0,
            DataType::I8 => 127.0,
            DataType::U8 => 255.0,
            DataType::I16 => 32767.0,
            DataType::U16 => 65535.0,
            DataType::U32 | DataType::F32 => 1.0,
        };
        let number = |bytes: &[u8]| match kind {
            DataType::I8 => f64::from(pod::<i8>(bytes)),
            DataType::U8 => f64::from(pod::<u8>(bytes)),
            DataType::I16 => f64::from(pod::<i16>(bytes)),
            DataType::U16 => f64::from(pod::<u16>(bytes)),
            DataType::U32 => f64::from(pod::<u32>(bytes)),
            DataType::F32 => f64::from(pod::<f32>(bytes)),
        };
        let (size, width) = (accessor.size(), kind.size());
        let element =
            |bytes: &[u8]| std::array::from_fn(|i| convert(number(&bytes[width * i..][..width]) / most));
        let mut elements = match accessor.view() {
            Some(view) => {
                let bytes = self.strided(&view, accessor.offset(), count, size)?;
                bytes.map(element).collect()
            }
            None => vec![[convert(0.0); N]; count],
        };
        if let Some(sparse) = accessor.sparse() {
            let (places, values) = (sparse.indices(), sparse.values());
            let width = match places.index_type() {
                IndexType::U8 => 1,
                IndexType::U16 => 2,
                IndexType::U32 => 4,
            };
            let at = self.strided(&places.view(), places.offset(), sparse.count(), width)?;
            let with = self.strided(&values.view(), values.offset(), sparse.count(), size)?;
            for (at, with) in at.zip(with) {
                let at = at.iter().rev().fold(0, |at, &byte| at << 8 | usize::from(byte));
                let slot = elements.get_mut(at);
                *slot.ok_or((format!("a sparse element {at}"), "one that exists"))? = element(with);
            }
        }
        Ok(elements)
    }

    fn strided<'a>(
        &'a self,
        view: &View,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, Problem> {
        let whole = self.0.get(view.buffer().index()).map_or(0, Vec::len);
        let Some(bytes) = self.view(view) else {
            let (from, to) = (view.offset(), view.offset().saturating_add(view.length()));
            let got = format!("a buffer view of bytes {from} to {to} of a buffer of {whole}");
            return Err((got, "a view inside its buffer"));
        };
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            return Err((format!("a byteStride of {stride}"), "no less than an element's size"));
        }
        let last = count.saturating_sub(1).checked_mul(stride);
        let end = last.and_then(|last| last.checked_add(size)?.checked_add(offset));
        if count > 0 && end.is_none_or(|end| end > bytes.len()) {
            let got = format!("{count} elements of {size} bytes in a view of {}", bytes.len());
            return Err((got, "a view that holds them"));
        }
        Ok((0..count).map(move |i| &bytes[offset + stride * i..][..size]))
    }
}
