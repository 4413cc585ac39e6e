//! Unique identifiers as functions of the content.

use super::item::Item;
use crate::files::PROGRAM;
use dicom_core::{DataElement, VR};
use dicom_dictionary_std::{tags, uids};
use dicom_object::meta::FileMetaTableBuilder;
use dicom_object::{FileDicomObject, InMemDicomObject};
use std::io::{self, Write};

/// A file to be written.
pub(super) type File = FileDicomObject<InMemDicomObject>;

/// The files of one series: each data set with its identifiers, and those of series, study and frame of reference. Without a study
/// name the series is a study.
pub(super) fn series(items: Vec<Item>, class: &str, study: Option<&str>) -> io::Result<Vec<File>> {
    let mut files = Vec::with_capacity(items.len());
    let mut hash = Hash::new(b"series");
    for item in items {
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
            .media_storage_sop_class_uid(class)
            .media_storage_sop_instance_uid("");
        let file = item
            .text(tags::SOP_CLASS_UID, VR::UI, class)
            .into_object()
            .with_exact_meta(meta.build().map_err(io::Error::other)?);
        file.write_dataset(&mut hash).map_err(io::Error::other)?;
        files.push(file);
    }
    let series = hash.uid();
    let study = study.unwrap_or(&series).as_bytes();
    let of = |what: &[u8], name: &[u8]| {
        let mut hash = Hash::new(what);
        // Hashing cannot fail.
        let _ = hash.write_all(name);
        hash.uid()
    };
    let (study, place) = (of(b"study", study), of(b"frame of reference", study));
    for (k, file) in files.iter_mut().enumerate() {
        let instance = of(format!("instance {k}").as_bytes(), series.as_bytes());
        for (tag, uid) in [
            (tags::SOP_INSTANCE_UID, &instance),
            (tags::SERIES_INSTANCE_UID, &series),
            (tags::STUDY_INSTANCE_UID, &study),
            (tags::FRAME_OF_REFERENCE_UID, &place),
        ] {
            file.put(DataElement::new(tag, VR::UI, uid.as_str()));
        }
        file.update_meta(|meta| meta.media_storage_sop_instance_uid = instance);
    }
    Ok(files)
}

/// The hash FNV-1a of 128 bits (<https://www.rfc-editor.org/rfc/rfc9923>): the same on every machine and in every version.
struct Hash(u128);

impl Hash {
    fn new(of: &[u8]) -> Self {
        let mut hash = Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        hash.take(PROGRAM.as_bytes());
        hash.take(of);
        hash
    }

    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul((1 << 88) + 0x13b);
        }
    }

    /// An identifier under 2.25 from a UUID of version 8 (<https://www.rfc-editor.org/rfc/rfc9562>).
    fn uid(&self) -> String {
        let kept = self.0 & !(0xf << 76) & !(0b11 << 62);
        format!("2.25.{}", kept | (8 << 76) | (0b10 << 62))
    }
}

impl Write for Hash {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.take(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
