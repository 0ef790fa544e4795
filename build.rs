//! Finds Debian's Embree (4 or else 3), binds it with bindgen, and tells the crate which one it is.
//!
//! Sets `cfg(embree3)` or `cfg(embree4)`; with the feature `embree` switched off it sets neither and the crate builds
//! on its pure-Rust backend alone.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=ffi/wrapper.h");
    println!("cargo::rustc-check-cfg=cfg(embree3)");
    println!("cargo::rustc-check-cfg=cfg(embree4)");
    provenance();
    #[cfg(feature = "embree")]
    embree::bind();
}

/// Tells the program what it was built from, where that can be known; measurements say so. Never a reason to fail.
fn provenance() {
    let answer = |program: &str, arguments: &[&str]| {
        let out = std::process::Command::new(program).args(arguments).output().ok()?;
        let text = String::from_utf8(out.stdout).ok()?.trim().to_owned();
        (out.status.success() && !text.is_empty()).then_some(text)
    };
    // A package inside of somebody else's repository must not take that one's commit for its own.
    let own = answer("git", &["rev-parse", "--show-prefix"]).is_none();
    if let Some(commit) = answer("git", &["rev-parse", "--short=12", "HEAD"]).filter(|_| own) {
        println!("cargo::rustc-env=LIGHTSIEVE_COMMIT={commit}");
        if let Some(log) = answer("git", &["rev-parse", "--git-path", "logs/HEAD"]) {
            println!("cargo::rerun-if-changed={log}");
        }
    }
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    if let Some(version) = answer(&rustc, &["--version"]) {
        println!("cargo::rustc-env=LIGHTSIEVE_RUSTC={version}");
    }
}

#[cfg(feature = "embree")]
mod embree {
    use std::path::{Path, PathBuf};

    /// The command that installs missing packages; printed with every error.
    const INSTALL: &str = "apt-get install -y libembree-dev libclang-dev";
    const WITHOUT: &str =
        "or build without Embree (slower, pure Rust): cargo build --release --no-default-features --features cli";

    pub fn bind() {
        let include_dirs = ["/usr/include", "/usr/local/include"];
        let found = |version: u32| {
            let header = format!("embree{version}/rtcore.h");
            include_dirs.iter().any(|dir| Path::new(dir).join(&header).exists())
        };
        let Some(version) = [4, 3].into_iter().find(|&v| found(v)) else {
            fail("Embree's headers were not found (looked for embree4/rtcore.h and embree3/rtcore.h)");
        };
        if !libclang_present() {
            fail("libclang was not found; bindgen needs it to read Embree's headers");
        }

        let bindings = bindgen::Builder::default()
            .header("ffi/wrapper.h")
            .allowlist_function("rtc(NewDevice|ReleaseDevice|GetDevice.*|SetDevice.*)")
            .allowlist_function("rtc(NewScene|ReleaseScene|CommitScene|SetScene.*|GetSceneBounds)")
            .allowlist_function("rtc(NewGeometry|ReleaseGeometry|CommitGeometry|AttachGeometryByID)")
            .allowlist_function("rtcSet(SharedGeometryBuffer|GeometryMask|GeometryUserPrimitiveCount|GeometryUserData|GeometryBoundsFunction|GeometryIntersectFunction|GeometryOccludedFunction|GeometryBuildQuality|GeometryTransform|GeometryInstancedScene|GeometryTimeStepCount)")
            .allowlist_function("rtc(Intersect1|Occluded1|Occluded16)")
            .allowlist_type("RTC(Ray|Hit|RayHit|Ray16|Error|Bounds|IntersectContext|RayQueryContext|IntersectArguments|OccludedArguments|BoundsFunctionArguments|IntersectFunctionNArguments|OccludedFunctionNArguments|DeviceProperty|FeatureFlags|RayQueryFlags)")
            // A newer library may return an unknown value: a Rust enum would make that undefined behaviour.
            .default_enum_style(bindgen::EnumVariation::NewType { is_bitfield: false, is_global: false })
            .bitfield_enum("RTC(SceneFlags|RayQueryFlags|FeatureFlags|IntersectContextFlags)")
            .prepend_enum_name(false)
            .derive_default(true)
            .layout_tests(true)
            .generate_comments(false)
            .generate()
            .unwrap_or_else(|e| fail(&format!("bindgen could not read Embree's headers: {e}")));

        let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("embree.rs");
        bindings.write_to_file(&out).unwrap_or_else(|e| fail(&format!("cannot write {}: {e}", out.display())));
        println!("cargo::rustc-cfg=embree{version}");
        println!("cargo::rustc-link-lib=embree{version}");
    }

    /// bindgen loads libclang at run time and panics without it; look first so that the message is ours.
    fn libclang_present() -> bool {
        std::env::var_os("LIBCLANG_PATH").is_some() || std::panic::catch_unwind(bindgen::clang_version).is_ok()
    }

    fn fail(reason: &str) -> ! {
        println!("cargo::error={reason}");
        println!("cargo::error=to install what is needed, type:  {INSTALL}");
        println!("cargo::error={WITHOUT}");
        std::process::exit(1);
    }
}
