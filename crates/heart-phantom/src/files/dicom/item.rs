//! A data set under construction.

use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_dictionary_std::tags;
use dicom_object::InMemDicomObject;

/// Longest number in decimal digits, bytes.
const DECIMAL: usize = 16;

/// A data set, or an item of a sequence.
pub(super) struct Item(InMemDicomObject);

impl Item {
    pub(super) fn new() -> Self {
        Self(InMemDicomObject::new_empty())
    }

    fn put(mut self, tag: Tag, vr: VR, value: PrimitiveValue) -> Self {
        self.0.put(DataElement::new(tag, vr, value));
        self
    }

    /// Text of any representation.
    pub(super) fn text(self, tag: Tag, vr: VR, text: &str) -> Self {
        self.put(tag, vr, PrimitiveValue::from(text))
    }

    /// Required attributes that may be empty (type 2).
    pub(super) fn empty(self, tags: &[(Tag, VR)]) -> Self {
        (tags.iter()).fold(self, |item, &(tag, vr)| {
            item.put(tag, vr, PrimitiveValue::Empty)
        })
    }

    /// Numbers in decimal digits.
    pub(super) fn decimals(self, tag: Tag, values: &[f64]) -> Self {
        let texts: Vec<String> = values.iter().map(|&value| decimal(value)).collect();
        self.text(tag, VR::DS, &texts.join("\\"))
    }

    /// Integers of 16 bits.
    pub(super) fn shorts(self, tag: Tag, values: Vec<u16>) -> Self {
        self.put(tag, VR::US, PrimitiveValue::U16(values.into()))
    }

    /// Pointers to attributes.
    pub(super) fn pointers(self, tag: Tag, to: Vec<Tag>) -> Self {
        self.put(tag, VR::AT, PrimitiveValue::Tags(to.into()))
    }

    pub(super) fn sequence(mut self, tag: Tag, items: Vec<Self>) -> Self {
        let items: Vec<_> = items.into_iter().map(|item| item.0).collect();
        let value = DataSetSequence::from(items);
        self.0.put(DataElement::new(tag, VR::SQ, value));
        self
    }

    /// A sequence of one code with its modifiers.
    pub(super) fn code(self, tag: Tag, [value, meaning]: [&str; 2], more: Self) -> Self {
        let code = more
            .text(tags::CODE_VALUE, VR::SH, value)
            .text(tags::CODING_SCHEME_DESIGNATOR, VR::SH, "SCT")
            .text(tags::CODE_MEANING, VR::LO, meaning);
        self.sequence(tag, vec![code])
    }

    /// The image itself, little-endian.
    pub(super) fn pixels(self, bytes: Vec<u8>, bits: u16) -> Self {
        let vr = if bits == 8 { VR::OB } else { VR::OW };
        self.put(tags::PIXEL_DATA, vr, PrimitiveValue::U8(bytes.into()))
    }

    pub(super) fn into_object(self) -> InMemDicomObject {
        self.0
    }
}

/// As many digits as fit.
pub(super) fn decimal(value: f64) -> String {
    let plain = value.to_string();
    if plain.len() <= DECIMAL {
        return plain;
    }
    let shorter = (0..DECIMAL)
        .rev()
        .map(|digits| format!("{value:.digits$e}"));
    // Without a point there are at most eight bytes.
    (shorter.into_iter().find(|text| text.len() <= DECIMAL)).unwrap_or(plain)
}
