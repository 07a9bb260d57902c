//! V4L2 against the kernel's header, and against a stand-in for its nodes: no such camera is here.

use super::abi::*;
use super::*;
use std::collections::BTreeMap;
use std::fs;
use std::mem::offset_of;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

/// Set in the process that has the stand-in.
const STANDS_IN: &str = "TRYON_TEST_STAND_IN";

/// Compiles a file of `testdata/`.
fn compile(name: &str, out: &Path, flags: &[&str]) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src/v4l2/testdata")
        .join(name);
    let status = Command::new("cc")
        .args(flags)
        .arg(&source)
        .arg("-o")
        .arg(out)
        .status();
    assert!(
        status
            .expect("a C compiler, as Rust needs one to link")
            .success(),
        "{name}"
    );
}

#[test]
fn structures_are_those_of_the_kernel() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("layout");
    compile("layout.c", &program, &[]);
    let out = Command::new(&program).output().expect("runs").stdout;
    let out = String::from_utf8(out).expect("text");
    let mut stated: BTreeMap<&str, u64> = BTreeMap::new();
    for line in out.lines() {
        let (name, number) = line.split_once(' ').expect("two words");
        stated.insert(name, number.parse().expect("a number"));
    }
    let mut ours: Vec<(&str, u64)> = vec![];
    macro_rules! structure {
        ($c:literal, $name:ident $(, $member:literal $field:ident)*) => {
            ours.push(($c, size_of::<$name>() as u64));
            $(ours.push((concat!($c, ".", $member), offset_of!($name, $field) as u64));)*
        };
    }
    structure!("v4l2_capability", Capability, "capabilities" capabilities, "device_caps" device_caps);
    structure!("v4l2_fmtdesc", FormatDescription, "type" kind, "pixelformat" pixel_format);
    structure!("v4l2_frmsizeenum", FrameSize, "pixel_format" pixel_format, "type" kind, "discrete.width" width,
        "discrete.height" height);
    structure!("v4l2_frmivalenum", FrameInterval, "width" width, "type" kind, "discrete.numerator" numerator,
        "discrete.denominator" denominator);
    structure!("v4l2_format", Format, "fmt.pix.width" width, "fmt.pix.pixelformat" pixel_format,
        "fmt.pix.bytesperline" bytes_per_line, "fmt.pix.sizeimage" size_image);
    structure!("v4l2_streamparm", StreamParameters, "parm.capture.timeperframe.numerator" numerator,
        "parm.capture.timeperframe.denominator" denominator);
    structure!("v4l2_requestbuffers", RequestBuffers, "count" count, "memory" memory);
    structure!("v4l2_buffer", Buffer, "index" index, "bytesused" bytes_used, "flags" flags,
        "timestamp.tv_sec" seconds, "timestamp.tv_usec" microseconds, "memory" memory, "m.offset" offset,
        "length" length);
    let requests = [
        ("VIDIOC_QUERYCAP", QUERYCAP),
        ("VIDIOC_ENUM_FMT", ENUM_FMT),
        ("VIDIOC_S_FMT", S_FMT),
        ("VIDIOC_REQBUFS", REQBUFS),
        ("VIDIOC_QUERYBUF", QUERYBUF),
        ("VIDIOC_QBUF", QBUF),
        ("VIDIOC_DQBUF", DQBUF),
        ("VIDIOC_STREAMON", STREAMON),
        ("VIDIOC_STREAMOFF", STREAMOFF),
        ("VIDIOC_S_PARM", S_PARM),
        ("VIDIOC_ENUM_FRAMESIZES", ENUM_FRAMESIZES),
        ("VIDIOC_ENUM_FRAMEINTERVALS", ENUM_FRAMEINTERVALS),
    ];
    ours.extend(requests);
    let numbers = [
        ("V4L2_BUF_TYPE_VIDEO_CAPTURE", CAPTURE),
        ("V4L2_MEMORY_MMAP", MEMORY_MMAP),
        ("V4L2_CAP_VIDEO_CAPTURE", CAP_CAPTURE),
        ("V4L2_CAP_STREAMING", CAP_STREAMING),
        ("V4L2_CAP_DEVICE_CAPS", CAP_DEVICE_CAPS),
        ("V4L2_FRMSIZE_TYPE_DISCRETE", DISCRETE),
        ("V4L2_BUF_FLAG_ERROR", BUFFER_ERROR),
        ("V4L2_PIX_FMT_Z16", fourcc(b"Z16 ")),
        ("V4L2_PIX_FMT_YUYV", fourcc(b"YUYV")),
        ("V4L2_PIX_FMT_UYVY", fourcc(b"UYVY")),
        ("V4L2_PIX_FMT_MJPEG", fourcc(b"MJPG")),
    ];
    ours.extend(numbers.map(|(name, number)| (name, u64::from(number))));
    for (name, number) in &ours {
        assert_eq!(stated.get(name), Some(number), "{name}");
    }
    assert_eq!(stated.len(), ours.len());
}

/// Folders of a box with the stand-in's camera: the kernel's class, and its nodes.
fn plug(root: &Path) -> Places {
    let device = root.join("usb2/2-1");
    let class = root.join("class");
    fs::create_dir_all(&class).expect("made");
    for (interface, number) in [(0, 0), (0, 1), (3, 2)] {
        let interface = device.join(format!("2-1:1.{interface}"));
        let node = interface.join(format!("video4linux/video{number}"));
        fs::create_dir_all(&node).expect("made");
        symlink(&interface, node.join("device")).expect("linked");
        symlink(&node, class.join(format!("video{number}"))).expect("linked");
    }
    for (file, text) in [
        ("idVendor", "8086\n"),
        ("product", "Stand-in\n"),
        ("serial", "0354\n"),
    ] {
        fs::write(device.join(file), text).expect("written");
    }
    Places {
        class,
        nodes: root.into(),
    }
}

fn calibration(root: &Path, width: u32) -> DeviceOptions {
    let lens = |w: u32| {
        format!(
            r#""width": {w}, "height": {}, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5"#,
            w / 4 * 3
        )
    };
    let pose = r#""color_from_depth": {"translation": [-0.015, 0, 0], "rotation": [0, 0, 0, 1]}"#;
    let text = format!(
        r#"{{{}, "depth_scale": 10000, "color": {{{}}}, {pose}}}"#,
        lens(width),
        lens(32)
    );
    let camera = root.join(format!("camera{width}.json"));
    fs::write(&camera, text).expect("written");
    DeviceOptions {
        camera: Some(camera),
    }
}

/// Runs a test with the stand-in in place of the kernel's nodes.
fn with_stand_in(test: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let library = folder.path().join("stand_in.so");
    compile(
        "stand_in.c",
        &library,
        &["-shared", "-fPIC", "-Wall", "-Werror"],
    );
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--exact", test, "--nocapture"]);
    command
        .env("LD_PRELOAD", &library)
        .env(STANDS_IN, folder.path());
    let out = command.output().expect("started");
    let text = [out.stdout, out.stderr].concat();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&text));
}

#[test]
fn the_stand_in_is_listed_and_faults_are_named() {
    let Some(root) = std::env::var_os(STANDS_IN) else {
        return with_stand_in("v4l2::tests::the_stand_in_is_listed_and_faults_are_named");
    };
    let root = Path::new(&root);
    let places = plug(root);
    let devices = places.list().expect("listed");
    let [device] = devices.as_slice() else {
        panic!("{devices:?}");
    };
    assert_eq!(
        (device.serial.as_str(), device.name.as_str()),
        ("0354", "Stand-in")
    );
    let modes: Vec<_> = device
        .modes
        .iter()
        .map(|m| (m.stream.name(), m.width, m.height, m.rate))
        .collect();
    assert_eq!(
        modes[..2],
        [("depth", 64, 48, 15.0), ("depth", 64, 48, 30.0)]
    );
    assert_eq!(
        modes[4..],
        [("color", 32, 24, 30.0), ("color", 32, 24, 6.0)]
    );
    let fault = |serial, options: &DeviceOptions| {
        places
            .open(serial, options)
            .err()
            .expect("refused")
            .to_string()
    };
    let without = fault(None, &DeviceOptions::default());
    assert!(
        without.starts_with("v4l2:0354: `camera`: V4L2 states no calibration"),
        "{without}"
    );
    let size = fault(None, &calibration(root, 80));
    assert!(
        size.contains("no mode of 80×60") && size.ends_with("there are 64×48"),
        "{size}"
    );
    let absent = fault(Some("0355"), &calibration(root, 64));
    assert_eq!(absent, "v4l2:0355: not plugged in; plugged in: 0354");
}

#[test]
fn frames_of_the_stand_in_are_read_until_it_is_unplugged() {
    let Some(root) = std::env::var_os(STANDS_IN) else {
        return with_stand_in("v4l2::tests::frames_of_the_stand_in_are_read_until_it_is_unplugged");
    };
    let root = Path::new(&root);
    let places = plug(root);
    let opened = places
        .open(Some("0354"), &calibration(root, 64))
        .expect("opened");
    let mut source = crate::source::start(opened).expect("started");
    let (mut frames, mut colors) = (0, 0);
    let fault = loop {
        let frame = match source.next_frame() {
            Ok(frame) => frame.expect("endless until it fails"),
            Err(fault) => break fault.to_string(),
        };
        let image = (frame.time_ns + 1_000_000) / 33_333_000;
        assert_ne!(image, 3, "is damaged");
        assert_eq!(frame.time_ns, image * 33_333_000);
        // A tenth of a millimetre each.
        let mm = (f64::from(1000 + image as u16) / 10.0).round() as u16;
        assert!(frame.depth.data().len() == 64 * 48 && frame.depth.data().iter().all(|d| *d == mm));
        if let Some(rgb) = frame.color {
            // Grey of ITU-R BT.601: luma 16 is black, 235 white.
            let grey = (255.0 / 219.0 * image as f64).round() as u8;
            assert!(
                rgb.data().len() == 3 * 32 * 24 && rgb.data().iter().all(|c| c.abs_diff(grey) <= 1)
            );
            colors += 1;
        }
        frames += 1;
    };
    assert!(
        (15..20).contains(&frames) && colors >= 15,
        "{frames} frames, {colors} with colour"
    );
    assert!(
        fault.starts_with("v4l2:0354: `depth`: ") || fault.starts_with("v4l2:0354: `color`: "),
        "{fault}"
    );
    assert!(fault.contains("No such device"), "{fault}");
    drop(source);
    // Plugged in again.
    let opened = places
        .open(None, &calibration(root, 64))
        .expect("opened again");
    let frame = crate::source::start(opened).expect("started").next_frame();
    assert!(frame.expect("a frame").is_some());
}
