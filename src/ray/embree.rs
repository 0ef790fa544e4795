//! The Embree backend, and the only place with `unsafe` code.
//!
//! Embree 3 (Debian 12) and Embree 4 (Debian 13) differ in how a query passes its context and in a few sizes; all of
//! that is in the module `version` below. Scenes are built with the ROBUST flag (no leaks at shared edges, and packets
//! of any width give the answers of single rays) at medium quality; packets are never flagged coherent, which is
//! slower.
//!
//! Round shapes are user geometry: Embree finds the boxes that a ray meets and calls back for the shapes in them, which
//! are met in double precision (Embree's own spheres are met in single precision). All round shapes of the world, or of a
//! group, are one geometry; hits on them report the shape's number as their geometry's, so that a hit is read in one way.
#![allow(unsafe_code)]

use super::geometry::Geometry;
use super::{Hit, NONE, PACKET, QueryError, Ray, RayQuery, RoundShape, SegmentPacket, SurfaceMask, T_MIN, lanes};
use glam::Vec4;
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::{Arc, Mutex};

#[allow(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    clippy::all,
    clippy::pedantic,
    clippy::undocumented_unsafe_blocks
)]
mod sys {
    include!(concat!(env!("OUT_DIR"), "/embree.rs"));
}
use sys::*;

/// Differences between the versions.
#[cfg(embree3)]
mod version {
    use super::sys::*;

    /// `rtcInitIntersectContext` is an inline function of the C header and has no symbol.
    fn context() -> RTCIntersectContext {
        RTCIntersectContext {
            flags: RTCIntersectContextFlags::RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
            filter: None,
            instID: [u32::MAX],
        }
    }

    /// # Safety
    /// `scene` is committed and alive; `rayhit` holds a valid ray.
    pub unsafe fn intersect1(scene: RTCScene, rayhit: &mut RTCRayHit) {
        // SAFETY: the caller's promise; the context lives until the call returns.
        unsafe { rtcIntersect1(scene, &mut context(), rayhit) }
    }

    /// # Safety
    /// As [`intersect1`].
    pub unsafe fn occluded1(scene: RTCScene, ray: &mut RTCRay) {
        // SAFETY: the caller's promise.
        unsafe { rtcOccluded1(scene, &mut context(), ray) }
    }

    /// # Safety
    /// As [`intersect1`]; lanes whose `valid` is zero are not looked at.
    pub unsafe fn occluded16(scene: RTCScene, valid: &super::Valid, rays: &mut RTCRay16) {
        // SAFETY: the caller's promise; `Valid` and `RTCRay16` have the alignment of 64 bytes that the call wants.
        unsafe { rtcOccluded16(valid.0.as_ptr(), scene, &mut context(), rays) }
    }

    /// Tells whether a callback found a hit in a lane, by whose flag Embree does not look: the end of the ray says it.
    pub fn report(_valid: &mut i32, _met: bool) {}
}

/// Differences between the versions.
#[cfg(embree4)]
mod version {
    use super::sys::*;
    use std::ptr::null_mut;

    /// # Safety
    /// `scene` is committed and alive; `rayhit` holds a valid ray.
    pub unsafe fn intersect1(scene: RTCScene, rayhit: &mut RTCRayHit) {
        // SAFETY: the caller's promise; null arguments mean the defaults (all features, incoherent).
        unsafe { rtcIntersect1(scene, rayhit, null_mut()) }
    }

    /// # Safety
    /// As [`intersect1`].
    pub unsafe fn occluded1(scene: RTCScene, ray: &mut RTCRay) {
        // SAFETY: the caller's promise.
        unsafe { rtcOccluded1(scene, ray, null_mut()) }
    }

    /// # Safety
    /// As [`intersect1`]; lanes whose `valid` is zero are not looked at.
    pub unsafe fn occluded16(scene: RTCScene, valid: &super::Valid, rays: &mut RTCRay16) {
        // SAFETY: the caller's promise; `Valid` and `RTCRay16` have the alignment of 64 bytes that the call wants.
        unsafe { rtcOccluded16(valid.0.as_ptr(), scene, rays, null_mut()) }
    }

    /// Tells whether a callback found a hit in a lane, by its flag.
    pub fn report(valid: &mut i32, met: bool) {
        *valid = -i32::from(met);
    }
}

/// Lane mask of a packet: −1 for a lane in use.
#[repr(C, align(64))]
struct Valid([i32; PACKET]);

/// The first error that Embree reported, if any. Boxed: Embree keeps its address.
type ErrorSlot = Mutex<Option<String>>;

/// Embree calls this on every error; it must not unwind.
unsafe extern "C" fn on_error(user: *mut c_void, code: RTCError, message: *const c_char) {
    if user.is_null() {
        return;
    }
    // SAFETY: `user` is the address of the device's `ErrorSlot`, which lives until after the device is released.
    let slot = unsafe { &*user.cast::<ErrorSlot>() };
    let text = if message.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a NUL-terminated string that lives during the call.
        unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned()
    };
    if let Ok(mut first) = slot.lock() {
        first.get_or_insert_with(|| format!("Embree error {}: {text}", code.0));
    }
}

/// An Embree device with its error slot; released on drop.
struct Device {
    raw: RTCDevice,
    errors: Box<ErrorSlot>,
}

// SAFETY: Embree's manual (§ "Embree API") says that API calls on a device are thread-safe unless they modify the same
// object; this type only creates and queries, and modification happens through `&mut` or before the scene is shared.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    fn new(threads: usize) -> Result<Device, QueryError> {
        let config = CString::new(format!("threads={threads}")).map_err(|e| QueryError(e.to_string()))?;
        // SAFETY: the configuration is a NUL-terminated string that outlives the call.
        let raw = unsafe { rtcNewDevice(config.as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the thread's error of the failed creation.
            let code = unsafe { rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(QueryError(format!("Embree could not create a device (error {})", code.0)));
        }
        let errors = Box::new(ErrorSlot::default());
        let user = std::ptr::from_ref::<ErrorSlot>(&errors).cast_mut().cast::<c_void>();
        // SAFETY: the slot is boxed and outlives the device, which is released in `drop` before the box is freed.
        unsafe { rtcSetDeviceErrorFunction(raw, Some(on_error), user) };
        Ok(Device { raw, errors })
    }

    /// Turns a reported error into a `Result`.
    fn check(&self) -> Result<(), QueryError> {
        match self.errors.lock().ok().and_then(|mut e| e.take()) {
            Some(message) => Err(QueryError(message)),
            None => Ok(()),
        }
    }

    fn version(&self) -> String {
        // SAFETY: the device is alive.
        let get = |p| unsafe { rtcGetDeviceProperty(self.raw, p) };
        format!(
            "{}.{}.{}",
            get(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MAJOR),
            get(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MINOR),
            get(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_PATCH)
        )
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: created by `rtcNewDevice`, released once.
        unsafe { rtcReleaseDevice(self.raw) };
    }
}

/// A committed scene, released on drop.
struct SceneHandle(RTCScene);

impl Drop for SceneHandle {
    fn drop(&mut self) {
        // SAFETY: created by `rtcNewScene`, released once; Embree keeps what instances still refer to.
        unsafe { rtcReleaseScene(self.0) };
    }
}

/// The round shapes of the world or of a group, as callbacks find them.
struct RoundPool {
    geometry: Arc<Geometry>,
    /// Index of the first one in [`Geometry::round`].
    first: usize,
    /// The geometry that hits on the first one report; those on others report the numbers that follow.
    number: u32,
}

/// The pool's shape number `primitive`.
///
/// # Safety
/// `user` is the address of a live [`RoundPool`] which has the shape.
unsafe fn pool_shape<'a>(user: *mut c_void, primitive: u32) -> (&'a RoundPool, &'a RoundShape) {
    // SAFETY: the caller's promise.
    let pool = unsafe { &*user.cast::<RoundPool>() };
    (pool, &pool.geometry.round[pool.first + primitive as usize])
}

/// Embree asks for the box of a shape; it must not unwind.
unsafe extern "C" fn round_bounds(args: *const RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes arguments that live during the call, with the pool given to the geometry.
    unsafe {
        let args = &*args;
        let (lo, hi) = pool_shape(args.geometryUserPtr, args.primID).1.bounds();
        let out = &mut *args.bounds_o;
        (out.lower_x, out.lower_y, out.lower_z) = (lo.x, lo.y, lo.z);
        (out.upper_x, out.upper_y, out.upper_z) = (hi.x, hi.y, hi.z);
    }
}

/// Embree found rays in the box of a shape; it must not unwind.
unsafe extern "C" fn round_intersect(args: *const RTCIntersectFunctionNArguments) {
    // SAFETY: Embree passes arguments that live during the call: `N` rays with hits in rows of `N` floats that nobody
    // else refers to, as many flags of lanes in use, the query's context, and the pool given to the geometry.
    unsafe {
        let args = &*args;
        let (pool, shape) = pool_shape(args.geometryUserPtr, args.primID);
        let n = args.N as usize;
        let rows = std::slice::from_raw_parts_mut(args.rayhit.cast::<f32>(), lanes::RAY_HIT_ROWS * n);
        let valid = std::slice::from_raw_parts_mut(args.valid, n);
        let ids = [pool.number + args.primID, (*args.context).instID[0]];
        for (lane, valid) in valid.iter_mut().enumerate().filter(|(_, valid)| **valid != 0) {
            version::report(valid, lanes::intersect(rows, [n, lane], shape, ids));
        }
    }
}

/// Embree found segments in the box of a shape; it must not unwind.
unsafe extern "C" fn round_occluded(args: *const RTCOccludedFunctionNArguments) {
    // SAFETY: as in `round_intersect`, without hits.
    unsafe {
        let args = &*args;
        let (_, shape) = pool_shape(args.geometryUserPtr, args.primID);
        let n = args.N as usize;
        let rows = std::slice::from_raw_parts_mut(args.ray.cast::<f32>(), lanes::RAY_ROWS * n);
        let valid = std::slice::from_raw_parts_mut(args.valid, n);
        for (lane, valid) in valid.iter_mut().enumerate().filter(|(_, valid)| **valid != 0) {
            version::report(valid, lanes::occlude(rows, [n, lane], shape));
        }
    }
}

/// A scene of shared buffers. Fields are dropped in order: scenes, then the device, then what they read.
pub struct EmbreeScene {
    top: SceneHandle,
    _groups: Vec<SceneHandle>,
    device: Device,
    /// Embree keeps their addresses.
    _pools: Vec<Arc<RoundPool>>,
    geometry: Arc<Geometry>,
}

// SAFETY: queries on a committed scene are read-only and may run on any number of threads (Embree's manual, §
// "rtcIntersect1"); the handles are never modified after `build`.
unsafe impl Send for EmbreeScene {}
// SAFETY: as above.
unsafe impl Sync for EmbreeScene {}

impl EmbreeScene {
    /// Builds the tree with at most `threads` threads.
    ///
    /// # Errors
    /// If Embree reports one.
    pub fn build(geometry: Arc<Geometry>, threads: usize) -> Result<EmbreeScene, QueryError> {
        let device = Device::new(threads)?;
        let mut pools = vec![];
        let mut groups = Vec::with_capacity(geometry.groups.len());
        for surfaces in &geometry.groups {
            let scene = new_scene(&device);
            // Geometries are numbered by their place in the group.
            let number = geometry.meshes_of(surfaces).len() as u32;
            attach_surfaces(&device, &scene, &geometry, surfaces, number, &mut pools)?;
            commit(&scene);
            device.check()?;
            groups.push(scene);
        }
        let top = new_scene(&device);
        if geometry.meshes_of(&geometry.world).iter().enumerate().any(|(id, &mesh)| mesh as usize != id) {
            return Err(QueryError("the meshes of the world are not the first ones".into()));
        }
        attach_surfaces(&device, &top, &geometry, &geometry.world, geometry.meshes.len() as u32, &mut pools)?;
        for (i, instance) in geometry.instances.iter().enumerate() {
            let id = first_instance(&geometry) + i as u32;
            attach_instance(&device, &top, &groups[instance.group as usize], instance, id);
        }
        commit(&top);
        device.check()?;
        Ok(EmbreeScene { top, _groups: groups, device, _pools: pools, geometry })
    }
}

/// Number of the first instance among the geometries of the world: behind its meshes and the pool of its round shapes.
fn first_instance(geometry: &Geometry) -> u32 {
    geometry.meshes_of(&geometry.world).len() as u32 + 1
}

/// Attaches the meshes among `surfaces`, numbered from 0, and then the pool of the round ones; hits on the first of
/// these report the geometry `number`.
fn attach_surfaces(
    device: &Device,
    scene: &SceneHandle,
    geometry: &Arc<Geometry>,
    surfaces: &[u32],
    number: u32,
    pools: &mut Vec<Arc<RoundPool>>,
) -> Result<(), QueryError> {
    let (meshes, round) = surfaces.split_at(geometry.meshes_of(surfaces).len());
    for (id, &mesh) in meshes.iter().enumerate() {
        attach_mesh(device, scene, geometry, mesh, id as u32);
    }
    let Some(&first) = round.first() else { return Ok(()) };
    let in_a_row = round.iter().zip(first..).all(|(&surface, expected)| surface == expected);
    let first = first as usize - geometry.meshes.len();
    if !in_a_row || first + round.len() > geometry.round.len() {
        return Err(QueryError("round shapes that stand together are not in a row".into()));
    }
    let pool = Arc::new(RoundPool { geometry: geometry.clone(), first, number });
    attach_pool(device, scene, &pool, round.len() as u32, meshes.len() as u32);
    pools.push(pool);
    Ok(())
}

/// Attaches `count` round shapes as the geometry `id`.
fn attach_pool(device: &Device, scene: &SceneHandle, pool: &RoundPool, count: u32, id: u32) {
    let user = std::ptr::from_ref::<RoundPool>(pool).cast_mut().cast::<c_void>();
    // SAFETY: device and scene are alive. The pool does not move and is owned by the finished `EmbreeScene`, which frees
    // it after scenes and device; callbacks only read it. Masks are looked at by the callbacks, shape by shape.
    unsafe {
        let handle = rtcNewGeometry(device.raw, RTCGeometryType::RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(handle, count);
        rtcSetGeometryUserData(handle, user);
        rtcSetGeometryBoundsFunction(handle, Some(round_bounds), std::ptr::null_mut());
        rtcSetGeometryIntersectFunction(handle, Some(round_intersect));
        rtcSetGeometryOccludedFunction(handle, Some(round_occluded));
        rtcSetGeometryMask(handle, u32::MAX);
        rtcCommitGeometry(handle);
        rtcAttachGeometryByID(scene.0, handle, id);
        rtcReleaseGeometry(handle);
    }
}

fn new_scene(device: &Device) -> SceneHandle {
    // SAFETY: the device is alive; flags and quality are set before anything is attached.
    unsafe {
        let scene = rtcNewScene(device.raw);
        rtcSetSceneFlags(scene, RTCSceneFlags::RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene, RTCBuildQuality::RTC_BUILD_QUALITY_MEDIUM);
        SceneHandle(scene)
    }
}

fn attach_mesh(device: &Device, scene: &SceneHandle, geometry: &Geometry, mesh: u32, id: u32) {
    let buffers = &geometry.meshes[mesh as usize];
    // SAFETY: device and scene are alive. The buffers are owned by the `Geometry` that the finished `EmbreeScene`
    // holds, are never moved or written, hold one spare vertex behind the last (`VertexBuffer`), and every index is in
    // range by `MeshBuffers`' contract (Embree drops a triangle whose index is not). The geometry handle is released
    // after the scene holds its own reference.
    unsafe {
        let handle = rtcNewGeometry(device.raw, RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(
            handle,
            RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
            0,
            RTCFormat::RTC_FORMAT_FLOAT3,
            buffers.positions.as_ptr().cast::<c_void>(),
            0,
            12,
            buffers.positions.len(),
        );
        rtcSetSharedGeometryBuffer(
            handle,
            RTCBufferType::RTC_BUFFER_TYPE_INDEX,
            0,
            RTCFormat::RTC_FORMAT_UINT3,
            buffers.triangles.as_ptr().cast::<c_void>(),
            0,
            12,
            buffers.triangles.len(),
        );
        rtcSetGeometryMask(handle, buffers.surface.bits());
        rtcCommitGeometry(handle);
        rtcAttachGeometryByID(scene.0, handle, id);
        rtcReleaseGeometry(handle);
    }
}

fn attach_instance(
    device: &Device,
    scene: &SceneHandle,
    group: &SceneHandle,
    instance: &super::geometry::Instance,
    id: u32,
) {
    let m = instance.to_world.matrix3;
    let columns: [[f32; 3]; 4] =
        [m.x_axis.to_array(), m.y_axis.to_array(), m.z_axis.to_array(), instance.to_world.translation.to_array()];
    // SAFETY: device, scene and group are alive; the matrix is copied during the call.
    unsafe {
        let handle = rtcNewGeometry(device.raw, RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(handle, group.0);
        rtcSetGeometryTimeStepCount(handle, 1);
        rtcSetGeometryTransform(handle, 0, RTCFormat::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.as_ptr().cast());
        // The meshes of the group have masks of their own. Embree 4's default mask is 1, Embree 3's is all ones.
        rtcSetGeometryMask(handle, u32::MAX);
        rtcCommitGeometry(handle);
        rtcAttachGeometryByID(scene.0, handle, id);
        rtcReleaseGeometry(handle);
    }
}

fn commit(scene: &SceneHandle) {
    // SAFETY: the scene is alive and no other thread uses it yet.
    unsafe { rtcCommitScene(scene.0) };
}

/// `RTCRay` as rows of four floats. Embree reads a ray in whole rows as soon as it is called: a row that was written
/// piece by piece would have to wait until all its pieces have reached the cache.
#[repr(C, align(16))]
struct RayRows {
    o_near: Vec4,
    d_time: Vec4,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

const _: () = assert!(size_of::<RayRows>() == size_of::<RTCRay>() && align_of::<RayRows>() >= align_of::<RTCRay>());
const _: () = assert!(size_of::<RTCRayHit>() == size_of::<RTCRay>() + size_of::<RTCHit>());

/// `RTCRayHit` with the ray as rows.
#[repr(C, align(16))]
struct RayHitRows {
    ray: RayRows,
    hit: RTCHit,
}

#[inline(always)]
fn raw_ray(ray: &Ray, surfaces: SurfaceMask) -> RayRows {
    debug_assert!(ray.is_valid());
    RayRows {
        o_near: ray.o.extend(ray.t_min),
        d_time: ray.d.extend(0.0),
        t_far: ray.t_max,
        mask: surfaces.bits(),
        id: 0,
        flags: 0,
    }
}

impl EmbreeScene {
    /// [`RayQuery::closest_of`], for callers that know the backend.
    #[inline(always)]
    pub fn first_hit(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        let mut rows = RayHitRows { ray: raw_ray(ray, surfaces), hit: RTCHit::default() };
        rows.hit.geomID = u32::MAX;
        rows.hit.instID = [u32::MAX];
        // SAFETY: the scene is committed and alive, the ray is valid (checked by the caller, see `Ray::is_valid`). Both
        // types are `repr(C)` with the same fields in the same places (sizes are checked above) and any bits are valid
        // in either.
        unsafe { version::intersect1(self.top.0, &mut *(&raw mut rows).cast::<RTCRayHit>()) };
        let hit = &rows.hit;
        if hit.geomID == u32::MAX {
            return None;
        }
        // A surface of the world has the number of its geometry (checked when the scene was built).
        let (mesh, instance) =
            if hit.instID[0] == u32::MAX { (hit.geomID, NONE) } else { self.in_instance(hit.geomID, hit.instID[0]) };
        Some(Hit { t: rows.ray.t_far, u: hit.u, v: hit.v, triangle: hit.primID, mesh, instance })
    }

    /// Surface and instance of a hit on an instance.
    #[cold]
    fn in_instance(&self, geometry: u32, instance: u32) -> (u32, u32) {
        let instance = instance - first_instance(&self.geometry);
        let group = self.geometry.instances[instance as usize].group;
        (self.geometry.groups[group as usize][geometry as usize], instance)
    }
}

/// Replaces lanes that are not valid by rays without extent.
#[cold]
fn scrub(valid: &Valid, rays: &mut RTCRay16) {
    for i in (0..PACKET).filter(|&i| valid.0[i] == 0) {
        for lanes in [&mut rays.org_x, &mut rays.org_y, &mut rays.org_z] {
            lanes[i] = 0.0;
        }
        for lanes in [&mut rays.dir_x, &mut rays.dir_y, &mut rays.dir_z] {
            lanes[i] = 0.0;
        }
    }
}

impl RayQuery for EmbreeScene {
    fn describe(&self) -> String {
        format!("Embree {}", self.device.version())
    }

    fn as_embree(&self) -> Option<&EmbreeScene> {
        Some(self)
    }

    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        self.first_hit(ray, surfaces)
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        let mut rows = raw_ray(ray, blockers);
        // SAFETY: as in `first_hit`.
        unsafe { version::occluded1(self.top.0, &mut *(&raw mut rows).cast::<RTCRay>()) };
        // Embree sets tfar to −∞ when something is in the way.
        rows.t_far < 0.0
    }

    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        let mut rays = RTCRay16 {
            org_x: packet.o[0],
            org_y: packet.o[1],
            org_z: packet.o[2],
            tnear: [T_MIN; PACKET],
            dir_x: packet.d[0],
            dir_y: packet.d[1],
            dir_z: packet.d[2],
            time: [0.0; PACKET],
            tfar: packet.t_max,
            mask: [packet.blockers.bits(); PACKET],
            id: [0; PACKET],
            flags: [0; PACKET],
        };
        // The test of `Ray::is_valid`, lane by lane so that it vectorises; lanes that fail it or are not in use stay
        // out.
        let mut valid = Valid([0; PACKET]);
        for i in 0..PACKET {
            let sum = rays.org_x[i].abs()
                + rays.org_y[i].abs()
                + rays.org_z[i].abs()
                + rays.dir_x[i].abs()
                + rays.dir_y[i].abs()
                + rays.dir_z[i].abs();
            valid.0[i] = -i32::from(sum < 1e18);
        }
        // Embree's assertions look at lanes that are masked out as well, so what is not valid must not be there at all.
        if valid.0.contains(&0) {
            scrub(&valid, &mut rays);
        }
        for lane in &mut valid.0[packet.len..] {
            *lane = 0;
        }
        // SAFETY: the scene is committed and alive; lanes in use hold valid rays; alignment by the types.
        unsafe { version::occluded16(self.top.0, &valid, &mut rays) };
        let (mut mask, mut invalid) = (0u16, 0);
        for i in 0..packet.len {
            let bad = valid.0[i] == 0;
            invalid += u32::from(bad);
            mask |= u16::from(bad || rays.tfar[i] < 0.0) << i;
        }
        (mask, invalid)
    }
}

#[cfg(test)]
mod tests;
