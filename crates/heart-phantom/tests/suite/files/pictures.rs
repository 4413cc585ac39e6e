//! PNG and GIF, decoded.

use super::*;
use heart_phantom::files::{Section, png_bytes, write_gif, write_png};

/// One marked voxel, off-centre along all axes; black elsewhere.
fn marked(ix: usize, iy: usize, iz: usize) -> Vec<u8> {
    let mut samples = vec![0; 60];
    samples[(iz * 4 + iy) * 5 + ix] = 200;
    samples
}

#[test]
fn sections_have_left_on_the_right_and_the_head_on_top() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let samples = marked(3, 1, 2);
    let volume = Volume::new(grid(Format::Nifti), samples.as_slice()).unwrap();
    // Size of the image, and the column and row of the voxel in it.
    for (section, size, pixel) in [
        (Section::Axial(2), (5, 4), (3, 1)),
        (Section::Coronal(1), (5, 3), (3, 0)),
        (Section::Sagittal(3), (4, 3), (1, 0)),
    ] {
        write_png(&path, &volume, section, [0.0, 400.0]).unwrap();
        let file = std::io::BufReader::new(fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut shades = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut shades).unwrap();
        assert_eq!((frame.width, frame.height), size);
        assert_eq!(frame.color_type, png::ColorType::Grayscale);
        for (k, shade) in shades.iter().enumerate() {
            let (x, y) = (k as u32 % size.0, k as u32 / size.0);
            // Half of the grey range: 127.5, rounded up.
            assert_eq!(*shade, if (x, y) == pixel { 128 } else { 0 }, "{section:?}");
        }
    }
    let bad = write_png(&path, &volume, Section::Axial(3), [0.0, 1.0]);
    assert!(matches!(
        bad,
        Err(PhantomError::Count {
            given: 3,
            most: 2,
            ..
        })
    ));
    for grey in [[0.0, 0.0], [1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::NAN]] {
        let bad = write_png(&path, &volume, Section::Axial(0), grey);
        assert!(matches!(bad, Err(PhantomError::OutOfRange { .. })));
    }
}

#[test]
fn a_gif_shows_each_frame_with_its_exact_greys() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("beat.gif");
    let frames: Vec<Vec<u8>> = (0..4).map(|k| marked(k, 3 - k, 1)).collect();
    let volumes: Vec<Volume> = frames
        .iter()
        .map(|f| Volume::new(grid(Format::Nifti), f.as_slice()).unwrap())
        .collect();
    write_gif(&path, &volumes, Section::Axial(1), [0.0, 255.0], 0.25).unwrap();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(&path).unwrap()).unwrap();
    let mut count = 0;
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!((frame.width, frame.height, frame.delay), (5, 4, 25));
        for (k, pixel) in frame.buffer.as_chunks::<4>().0.iter().enumerate() {
            let shade = if k == (3 - count) * 5 + count { 200 } else { 0 };
            assert_eq!(*pixel, [shade, shade, shade, 255]);
        }
        count += 1;
    }
    assert_eq!(count, 4);
    let write = |volumes: &[Volume], seconds| {
        write_gif(&path, volumes, Section::Axial(1), [0.0, 1.0], seconds)
    };
    assert!(matches!(write(&[], 0.1), Err(PhantomError::Count { .. })));
    assert!(matches!(
        write(&volumes, 0.0),
        Err(PhantomError::OutOfRange { .. })
    ));
    let other = VoxelGrid::cube(2, 1.0).unwrap();
    let mixed = [
        volumes[0],
        Volume::new(other, [0_u8; 8].as_slice()).unwrap(),
    ];
    assert!(matches!(
        write(&mixed, 0.1),
        Err(PhantomError::WrongLength { .. })
    ));
}

/// Three samples per pixel are red, green and blue.
#[test]
fn images_with_three_samples_per_pixel_are_in_colour() {
    let samples: Vec<u8> = (0..30).map(|k| 8 * k).collect();
    let bytes = png_bytes([5, 2], &samples).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut found = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut found).unwrap();
    assert_eq!(frame.color_type, png::ColorType::Rgb);
    assert_eq!((frame.width, frame.height), (5, 2));
    assert_eq!(found, samples);
    let rejected = png_bytes([5, 2], &samples[..13]);
    assert!(matches!(
        rejected,
        Err(PhantomError::WrongLength {
            given: 13,
            expected: 10,
            ..
        })
    ));
}
