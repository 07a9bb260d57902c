// The garments on the graphics card: visibility of faces, coverage of pixels, and light.
// The maths is that of composite::{coverage, shading, appearance, contact_shadow, blend}; a test compares the pictures.

struct Scene {
    // Focal lengths and principal point in samples of the drawn area, the latter + 0.5 (framebuffer positions).
    lens: vec4f,
    // Columns and rows of samples, near plane (metres), samples along each side of a pixel.
    size: vec4f,
    // Focal lengths and principal point of the picture's camera, pixels.
    camera: vec4f,
    // First column and row of the drawn area, columns and rows of the shadow image.
    area: vec4f,
    // Direction of up; strength of the sky.
    up: vec4f,
    // Direction of the key lamp; its strength.
    key: vec4f,
    // Ground, inside, contact, grain over 255.
    light: vec4f,
    // Fold gap (metres), shadow depth (metres), least shadow, displacement of inner sides (metres).
    limits: vec4f,
    // Change of the room's light with the normal over its mean: red, mean light; green, 1 where it is known; blue, lamp.
    red: vec4f,
    green: vec4f,
    blue: vec4f,
    // Light over that of the lamps, by channel.
    brightness: vec4f,
    // Number of the picture.
    picture: vec4u,
}

struct Fabric {
    // Linear reflectance; gloss.
    base: vec4f,
    // Second colour; metres per unit of texture coordinate.
    other: vec4f,
    // Kind (0 solid, 1 stripes, 2 check, 3 knit), period (metres), unused. Kind 4, a scale: third colour. Kind 5, an
    // image: metres per texel.
    pattern: vec4f,
    // First texel, columns, rows and levels of an image.
    image: vec4u,
    // First relief, levels of yarns, surface and wrinkles; none without a cloth.
    cloth: vec4u,
    // Sides of yarns and surface, pitch, ribs at lower edges, metres.
    sizes: vec4f,
    // Roughness, reflectance, fuzz, ribs at upper edges.
    look: vec4f,
    // Wave and place of puckers at lower and upper edges.
    pucker: vec4f,
    // Side of the wrinkles, metres; first relief of the trims and their number.
    wrinkle: vec4f,
}

struct Attribute {
    // Normal; openness.
    normal: vec4f,
    // Texture coordinate, depth, distance from a free edge.
    more: vec4f,
    // Length along that edge, distance from a seam, 1 at an upper edge, unused.
    place: vec4f,
    // Slopes of the four fields of ridges.
    ridges: vec4f,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> corners: array<u32>;
// Garment number, + 256 when seen from inside.
@group(0) @binding(3) var<storage, read> owners: array<u32>;
@group(0) @binding(4) var<storage, read> attributes: array<Attribute>;
@group(0) @binding(5) var<storage, read> fabrics: array<Fabric>;
// sRGB, 0xBBGGRR, level by level, row by row.
@group(0) @binding(6) var<storage, read> texels: array<u32>;
// Yarns, surface and wrinkles of each cloth, level by level; profiles of its lower and upper edges, and of its seams.
@group(0) @binding(7) var<storage, read> reliefs: array<vec4f>;
@group(1) @binding(0) var faces: texture_2d<u32>;
@group(1) @binding(1) var depths: texture_depth_2d;
@group(2) @binding(0) var pixels: texture_2d<u32>;
@group(2) @binding(1) var marks: texture_2d<f32>;
@group(2) @binding(2) var around: texture_2d<f32>;

const NONE: u32 = 0xffffffffu;

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) face: u32,
}

@vertex
fn garment_vertex(@builtin(vertex_index) index: u32) -> Seen {
    var p = points[corners[index]].xyz;
    let first = index / 3u * 3u;
    let a = points[corners[first]].xyz;
    let away = cross(points[corners[first + 1u]].xyz - a, points[corners[first + 2u]].xyz - a);
    if p.z > scene.size.z && dot(away, a) > 0.0 {
        p *= 1.0 + scene.limits.w / p.z;
    }
    let u = scene.lens.x * p.x + scene.lens.z * p.z;
    let v = scene.lens.y * p.y + scene.lens.w * p.z;
    var out: Seen;
    // Reversed depth: near / z, so that precision is spent evenly and z comes back exactly enough.
    out.position = vec4f(2.0 * u / scene.size.x - p.z, p.z - 2.0 * v / scene.size.y, scene.size.z, p.z);
    out.face = index / 3u;
    return out;
}

@fragment
fn garment_face(in: Seen) -> @location(0) u32 {
    return in.face;
}

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let x = f32(i32(index & 1u) * 4 - 1);
    let y = f32(i32(index >> 1u) * 4 - 1);
    return vec4f(x, y, 0.0, 1.0);
}

// Nearest depth (bits), its face, samples covered, one surface only.
@fragment
fn resolve(@builtin(position) at: vec4f) -> @location(0) vec4u {
    let n = i32(scene.size.w);
    let corner = vec2i(at.xy) * n;
    var nearest = 3.0e38;
    var far = 0.0;
    var face = NONE;
    var covered = 0u;
    var simple = 1u;
    for (var i = 0; i < n * n; i++) {
        let s = corner + vec2i(i % n, i / n);
        let id = textureLoad(faces, s, 0).x;
        if id == NONE {
            continue;
        }
        let z = scene.size.z / textureLoad(depths, s, 0);
        covered++;
        far = max(far, z);
        if face != NONE && (owners[face] & 255u) != (owners[id] & 255u) {
            simple = 0u;
        }
        if z < nearest {
            nearest = z;
            face = id;
        }
    }
    if far - nearest >= scene.limits.x {
        simple = 0u;
    }
    return vec4u(bitcast<u32>(nearest), face, covered, simple);
}

fn wave_integral(x: f32) -> f32 {
    return floor(x) * 0.5 + min(x - floor(x), 0.5);
}

fn square_wave(x: f32, width: f32) -> f32 {
    let w = max(width, 1e-3);
    return (wave_integral(x + 0.5 * w) - wave_integral(x - 0.5 * w)) / w;
}

fn linear_texel(index: u32) -> vec3f {
    let c = unpack4x8unorm(texels[index]).xyz;
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn image_at(f: Fabric, at: vec2f, footprint: f32) -> vec3f {
    let octave = log2(max(footprint / f.pattern.y, 1.0));
    let level = min(u32(octave + 0.5), f.image.w - 1u);
    var first = f.image.x;
    var size = f.image.yz;
    for (var k = 0u; k < level; k++) {
        first += size.x * size.y;
        size = (size + 1u) / 2u;
    }
    let metres = f.pattern.y * f32(1u << level);
    let p = clamp(at / metres - 0.5, vec2f(0.0), vec2f(size - 1u));
    let low = vec2u(p);
    let high = min(low + 1u, size - 1u);
    let w = p - floor(p);
    let top = mix(linear_texel(first + low.y * size.x + low.x), linear_texel(first + low.y * size.x + high.x), w.x);
    let bottom = mix(linear_texel(first + high.y * size.x + low.x), linear_texel(first + high.y * size.x + high.x), w.x);
    return mix(top, bottom, w.y);
}

fn albedo(f: Fabric, uv: vec2f, footprint: f32) -> vec3f {
    if f.pattern.x == 4.0 {
        if uv.x < 0.0 {
            return mix(f.base.xyz, f.pattern.yzw, min(-uv.x, 1.0));
        }
        return mix(f.base.xyz, f.other.xyz, min(uv.x, 1.0));
    }
    if f.pattern.x == 5.0 {
        return image_at(f, uv * f.other.w, footprint);
    }
    let period = f.pattern.y;
    let m = uv * f.other.w / period;
    let w = footprint / period;
    if f.pattern.x == 1.0 {
        return mix(f.base.xyz, f.other.xyz, square_wave(m.y, w));
    }
    if f.pattern.x == 2.0 {
        return mix(f.base.xyz, f.other.xyz, 0.5 * (square_wave(m.x, w) + square_wave(m.y, w)));
    }
    if f.pattern.x == 3.0 {
        let seen = clamp(1.0 - 2.0 * w, 0.0, 1.0);
        let slant = abs(fract(m.x) - 0.5);
        let ridge = 1.0 - 2.0 * abs(fract(m.y / 0.7 + slant) - 0.5);
        let edge = 2.0 * slant;
        return f.base.xyz * (1.0 - 0.35 * seen * (1.0 - ridge) - 0.2 * seen * edge * edge * edge * edge);
    }
    return f.base.xyz;
}

fn to_srgb(light: vec3f) -> vec3f {
    let c = clamp(light, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

// Texels of a tile with `levels` levels, and of those before level `level`.
fn texels_before(levels: u32, level: u32) -> u32 {
    var sum = 0u;
    for (var k = 0u; k < level; k++) {
        let n = 1u << (levels - 1u - k);
        sum += n * n;
    }
    return sum;
}

fn tile_level(first: u32, levels: u32, side: f32, level: u32, uv: vec2f) -> vec4f {
    let n = 1u << (levels - 1u - level);
    let base = first + texels_before(levels, level);
    let p = uv / side * f32(n) - 0.5;
    let low = floor(p);
    let w = p - low;
    let a = vec2u(vec2i(low)) & vec2u(n - 1u);
    let b = (a + 1u) & vec2u(n - 1u);
    let top = mix(reliefs[base + a.y * n + a.x], reliefs[base + a.y * n + b.x], w.x);
    let bottom = mix(reliefs[base + b.y * n + a.x], reliefs[base + b.y * n + b.x], w.x);
    return mix(top, bottom, w.y);
}

// Binary logarithm with a straight mantissa, from 0 on.
fn level_of(texels: f32) -> f32 {
    let b = bitcast<u32>(max(texels, 1.0));
    return f32(b >> 23u) - 127.0 + f32(b & 0x7fffffu) / 8388608.0;
}

fn tile_at(first: u32, levels: u32, side: f32, uv: vec2f, footprint: f32) -> vec4f {
    let finest = side / f32(1u << (levels - 1u));
    let level = level_of(footprint / finest);
    let low = min(u32(level), levels - 1u);
    if low == levels - 1u {
        return reliefs[first + texels_before(levels, low)];
    }
    let a = tile_level(first, levels, side, low, uv);
    let b = tile_level(first, levels, side, low + 1u, uv);
    return mix(a, b, level - f32(low));
}

fn tile_nearest(first: u32, levels: u32, side: f32, uv: vec2f, footprint: f32) -> vec4f {
    let finest = side / f32(1u << (levels - 1u));
    let level = min(u32(level_of(footprint / finest) + 0.5), levels - 1u);
    return tile_level(first, levels, side, level, uv);
}

const PROFILE: u32 = 257u;
const PROFILE_STEP: f32 = 2.5e-4;
const PROFILE_REACH: f32 = 0.064;

fn profile_at(first: u32, x: f32) -> vec4f {
    let at = min(x / PROFILE_STEP, f32(PROFILE - 1u));
    let k = min(u32(at), PROFILE - 2u);
    return mix(reliefs[first + k], reliefs[first + k + 1u], at - f32(k));
}

// Mean slope and mean light taken: of lower and upper edges, or of seams.
fn profile_mean(first: u32, distance: f32, footprint: f32) -> vec4f {
    let f = max(footprint, PROFILE_STEP);
    let lo = distance - 0.5 * f;
    let hi = distance + 0.5 * f;
    let side = vec4f(1.0, select(1.0, -1.0, lo < 0.0), 1.0, select(1.0, -1.0, lo < 0.0));
    return (profile_at(first, abs(hi)) - profile_at(first, abs(lo)) * side) / f;
}

struct Relief {
    slopes: vec4f,
    seam: f32,
    tone: f32,
    variance: f32,
}

const TAU: f32 = 6.2831853;

fn spread(t: vec4f) -> f32 {
    return max(t.w - 0.5 * dot(t.xy, t.xy), 0.0);
}

fn relief_of(
    f: Fabric, uv: vec2f, free: f32, along: f32, seam: f32, is_upper: bool, ridges: vec4f, footprint: f32,
) -> Relief {
    let yarns = f.cloth.x;
    let surface = yarns + texels_before(f.cloth.y, f.cloth.y);
    let wrinkles = surface + texels_before(f.cloth.z, f.cloth.z);
    let edges = wrinkles + texels_before(f.cloth.w, f.cloth.w);
    var s = reliefs[wrinkles - 1u];
    if footprint < 6e-3 {
        s = tile_nearest(surface, f.cloth.z, f.sizes.y, uv, footprint);
    }
    var y = reliefs[surface - 1u];
    if footprint < 2.0 * f.sizes.z {
        y = tile_at(yarns, f.cloth.y, f.sizes.x, uv, footprint);
    }
    var out: Relief;
    out.slopes = vec4f(s.xy + y.xy, 0.0, 0.0);
    out.tone = 1.0 + s.z + y.z;
    out.variance = spread(s) + spread(y);
    for (var k = 0u; k < 4u; k++) {
        let gain = ridges[k];
        if gain < 8e-3 {
            continue;
        }
        let c = vec4f(1.0, 0.70710678, 0.0, -0.70710678)[k];
        let s = vec4f(0.0, 0.70710678, 1.0, 0.70710678)[k];
        let turned = vec2f(uv.x * c + uv.y * s, uv.y * c - uv.x * s);
        let t = tile_nearest(wrinkles, f.cloth.w, f.wrinkle.x, turned, footprint);
        out.slopes.x += gain * (t.x * c - t.y * s);
        out.slopes.y += gain * (t.x * s + t.y * c);
        out.tone *= 1.0 + 0.12 * gain * t.z;
    }
    let reach = PROFILE_REACH + 0.5 * footprint;
    if free < reach {
        let both = profile_mean(edges, free, footprint);
        let profile = select(both.xy, both.zw, is_upper);
        let pucker = select(f.pucker.xy, f.pucker.zw, is_upper);
        let ribs = select(f.sizes.w, f.look.w, is_upper);
        out.slopes.z += profile.x;
        out.tone *= 1.0 - profile.y;
        if free < ribs {
            let seen = clamp(1.0 - footprint / 1.3e-3, 0.0, 1.0);
            let turn = TAU * fract(along / 2.6e-3);
            out.slopes.w += 0.9 * seen * cos(turn);
            out.tone *= 1.0 - 0.12 * (1.0 - seen * sin(turn));
            out.variance += 0.405 * (1.0 - seen);
        }
        if pucker.x > 0.0 {
            let near = max(1.0 - abs(free - pucker.y) / (1.5 * pucker.x), 0.0);
            let seen = clamp(1.0 - footprint / (0.5 * pucker.x), 0.0, 1.0);
            let uneven = cos(TAU * fract(along / pucker.x)) + sin(TAU * fract(along / (1.7 * pucker.x)));
            out.slopes.w += 0.09 * near * seen * uneven;
        }
    }
    if seam < reach {
        let profile = profile_mean(edges + PROFILE, seam, footprint);
        out.seam = profile.x;
        out.tone *= 1.0 - profile.y;
    }
    return out;
}

// Adds trims at a place of the texture (metres).
fn trim(f: Fabric, uv: vec2f, footprint: f32, out: ptr<function, Relief>) {
    let first = u32(f.wrinkle.y);
    let count = u32(f.wrinkle.z);
    var texel = first + 2u * count;
    for (var k = 0u; k < count; k++) {
        let at = reliefs[first + 2u * k];
        let size = reliefs[first + 2u * k + 1u];
        let levels = u32(size.w);
        let d = uv - at.xy;
        let own = vec2f(at.z * d.x + at.w * d.y, at.z * d.y - at.w * d.x);
        if abs(own.x) < size.x && abs(own.y) < size.y {
            let t = tile_nearest(texel, levels, size.z, own + 0.5 * size.z, footprint);
            (*out).slopes.x += at.z * t.x - at.w * t.y;
            (*out).slopes.y += at.w * t.x + at.z * t.y;
            (*out).tone *= 1.0 + t.z;
        }
        texel += texels_before(levels, levels);
    }
}

fn believed(g: vec3f) -> vec3f {
    return select(g, vec3f(0.0), dot(g, g) > 6.25);
}

// Light of the room, or of the lamps, on a surface; `open` is the share that reaches it.
fn irradiance(n: vec3f, open: f32) -> vec3f {
    if scene.green.w > 0.0 {
        let e = vec3f(1.0) + vec3f(dot(scene.red.xyz, n), dot(scene.green.xyz, n), dot(scene.blue.xyz, n));
        return scene.red.w * 0.5 * (e + sqrt(e * e + 0.02)) * open;
    }
    let hemi = scene.light.x + (scene.up.w - scene.light.x) * 0.5 * (1.0 + dot(n, scene.up.xyz));
    let key = max((dot(n, scene.key.xyz) + 0.25) / 1.25, 0.0) * scene.key.w;
    return vec3f(hemi * open + key * min(open, 1.0));
}

fn reflected(f: Fabric, n: vec3f, eye: vec3f, open: f32, variance: f32, color: vec3f) -> vec3f {
    let light = irradiance(n, open);
    let away = 1.0 - clamp(dot(n, eye), 0.0, 1.0);
    let fuzz = f.look.z * away * away * away;
    let alpha = min(f.look.x * f.look.x + 2.0 * variance, 1.0);
    let half_way = normalize(scene.key.xyz + eye);
    let h = max(dot(n, half_way), 0.0);
    let a2 = alpha * alpha;
    let wide = h * h * (a2 - 1.0) + 1.0;
    let lobe = a2 / (4.0 * wide * wide);
    let edge = pow(1.0 - clamp(dot(half_way, eye), 0.0, 1.0), 5.0);
    let fresnel = f.look.y + (1.0 - f.look.y) * edge;
    let shine = fresnel * lobe * max(dot(n, scene.key.xyz), 0.0) * scene.blue.w * min(open, 1.0);
    return (color * (1.0 - 0.5 * fuzz) + fuzz * (0.15 + 0.5 * color)) * light + shine;
}

// sRGB of a face at a position of the picture.
fn shaded(face: u32, at: vec2f, shadow: f32) -> vec3f {
    let i = vec3u(corners[3u * face], corners[3u * face + 1u], corners[3u * face + 2u]);
    let a = points[i.x].xyz;
    let b = points[i.y].xyz;
    let c = points[i.z].xyz;
    let ray = vec3f((at - scene.camera.zw) / scene.camera.xy, 1.0);
    var w = vec3f(dot(cross(b, c), ray), dot(cross(c, a), ray), dot(cross(a, b), ray));
    w = max(w / (w.x + w.y + w.z), vec3f(0.0));
    let sum = w.x + w.y + w.z;
    if sum > 0.0 {
        w = w / sum;
    } else {
        w = vec3f(1.0, 0.0, 0.0);
    }
    let low = attributes[i.x].normal * w.x + attributes[i.y].normal * w.y + attributes[i.z].normal * w.z;
    let high = attributes[i.x].more * w.x + attributes[i.y].more * w.y + attributes[i.z].more * w.z;
    let eye = -normalize(ray);
    var n = eye;
    if dot(low.xyz, low.xyz) > 0.0 {
        n = normalize(low.xyz);
    }
    let owner = owners[face];
    let inner = owner >= 256u;
    if inner {
        n = -n;
    }
    let facing = max(abs(dot(n, eye)), 0.2);
    let f = fabrics[owner & 255u];
    let footprint = high.z / (scene.camera.x * facing);
    let color = albedo(f, high.xy, footprint);
    let gain = scene.brightness.xyz * select(1.0, scene.light.y, inner) * (1.0 - shadow);
    if f.cloth.w > 0u {
        let place = attributes[i.x].place * w.x + attributes[i.y].place * w.y + attributes[i.z].place * w.z;
        let m = attributes[i.x].ridges * w.x + attributes[i.y].ridges * w.y + attributes[i.z].ridges * w.z;
        var relief = relief_of(f, high.xy * f.other.w, high.w, place.x, place.y, place.z > 0.5, m, footprint);
        trim(f, high.xy * f.other.w, footprint, &relief);
        let across = cross(b - a, c - a);
        let scale = 1.0 / max(dot(across, across), 1e-38);
        let ga = cross(across, c - b) * scale;
        let gb = cross(across, a - c) * scale;
        let gc = cross(across, b - a) * scale;
        let ma = attributes[i.x].more;
        let mb = attributes[i.y].more;
        let mc = attributes[i.z].more;
        let pa = attributes[i.x].place;
        let pb = attributes[i.y].place;
        let pc = attributes[i.z].place;
        let tilt = believed((ga * ma.x + gb * mb.x + gc * mc.x) * f.other.w) * relief.slopes.x
            + believed((ga * ma.y + gb * mb.y + gc * mc.y) * f.other.w) * relief.slopes.y
            + believed(ga * ma.w + gb * mb.w + gc * mc.w) * relief.slopes.z
            + believed(ga * pa.x + gb * pb.x + gc * pc.x) * relief.slopes.w
            + believed(ga * pa.y + gb * pb.y + gc * pc.y) * relief.seam;
        let tilted = normalize(n - select(tilt, -tilt, inner));
        return to_srgb(reflected(f, tilted, eye, low.w, relief.variance, color * relief.tone) * gain);
    }

    let hemi = scene.light.x + (scene.up.w - scene.light.x) * 0.5 * (1.0 + dot(n, scene.up.xyz));
    let key = max((dot(n, scene.key.xyz) + 0.25) / 1.25, 0.0) * scene.key.w;
    var sheen = 0.0;
    if f.base.w > 0.0 {
        let half_way = max(dot(n, normalize(scene.key.xyz + eye)), 0.0);
        sheen = f.base.w * 0.25 * pow(half_way, 16.0) * scene.key.w;
    }
    return to_srgb(color * (hemi * low.w + key * min(low.w, 1.0)) * gain + sheen * gain);
}

fn shadow_at(p: vec2i) -> vec3f {
    let last = vec2i(scene.area.zw) - 1;
    let odd = p % 2;
    let low = max(p / 2 + odd - 1, vec2i(0));
    let high = min(low + 1, last);
    let w = select(vec2f(0.75), vec2f(0.25), odd == vec2i(1));
    let top = mix(textureLoad(around, low, 0), textureLoad(around, vec2i(high.x, low.y), 0), w.x);
    let bottom = mix(textureLoad(around, vec2i(low.x, high.y), 0), textureLoad(around, high, 0), w.x);
    return mix(top, bottom, w.y).xyz;
}

fn noise(p: vec2u, picture: u32) -> f32 {
    var h = p.x * 0x9e3779b9u + p.y * 0x85ebca6bu + picture * 0xc2b2ae35u;
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    h = h ^ (h >> 16u);
    let sum = (h & 255u) + ((h >> 8u) & 255u) + ((h >> 16u) & 255u) + (h >> 24u);
    return (f32(sum) - 510.0) / 147.8;
}

// Blended as: colour + target · alpha.
@fragment
fn compose(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2i(at.xy);
    let pixel = textureLoad(pixels, p, 0);
    let mark = textureLoad(marks, p, 0);
    let near = shadow_at(p);
    let n = i32(scene.size.w);
    let hidden = mark.x;
    let cover = f32(pixel.z) / f32(n * n) * (1.0 - hidden);
    var dark = 1.0;
    if cover < 1.0 && near.x >= scene.limits.z && mark.y > 0.0 {
        let gap = mark.y - near.y / near.x;
        if gap >= -0.2 * scene.limits.y && gap <= scene.limits.y {
            dark = 1.0 - scene.light.z * near.x * (1.0 - max(gap / scene.limits.y, 0.0)) * (1.0 - hidden);
        }
    }
    var color = vec3f(0.0);
    if cover > 0.0 {
        let shadow = scene.light.z * near.z;
        let here = floor(at.xy) + scene.area.xy;
        if pixel.w == 1u {
            color = shaded(pixel.y, here, shadow);
        } else {
            for (var i = 0; i < n * n; i++) {
                let s = vec2i(i % n, i / n);
                let id = textureLoad(faces, p * n + s, 0).x;
                if id != NONE {
                    color += shaded(id, here + (vec2f(s) + 0.5) / f32(n) - 0.5, shadow);
                }
            }
            color /= f32(pixel.z);
        }
        let speck = noise(vec2u(floor(at.xy) + scene.area.xy), scene.picture.x);
        color = clamp(color + scene.light.w * speck, vec3f(0.0), vec3f(1.0));
    }
    return vec4f(color * cover, dark * (1.0 - cover));
}
