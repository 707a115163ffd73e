// Vectors are arrays of three. A camera looks along -Z, +X is right, +Y up; `axes` are its X, Y and Z in
// the world; pixel centres are at halves, row 0 on top; depth is planar.

const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const lengthOf = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / (lengthOf(a) || 1));

// World direction of one in camera space, and back.
const outOf = (camera, v) =>
    plus(plus(times(camera.axes[0], v[0]), times(camera.axes[1], v[1])), times(camera.axes[2], v[2]));
const into = (camera, v) => [dot(camera.axes[0], v), dot(camera.axes[1], v), dot(camera.axes[2], v)];

// The axes of a unit quaternion (w, x, y, z).
function axesOf([w, x, y, z]) {
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
}

// A vector turned around a unit axis.
function turned(v, axis, angle) {
    const c = Math.cos(angle), s = Math.sin(angle);
    return plus(plus(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}

// The arm from a target to an eye, turned from `home` by an angle of `most` at most.
function armWithin(arm, home, most) {
    const angle = Math.acos(Math.max(-1, Math.min(1, dot(unit(arm), unit(home)))));
    return angle <= most ? arm : times(turned(unit(home), unit(cross(home, arm)), most), lengthOf(arm));
}

// A camera at `eye` that looks at `target`; `fov` is vertical, in degrees.
function lookAt({eye, target, up, fov}, width, height) {
    const back = unit(minus(eye, target));
    let right = cross(up, back);
    // Along `up`: as lookAt() of lib/geometry/camera.cpp.
    if (!(lengthOf(right) > 1e-9 * lengthOf(up))) right = cross(Math.abs(back[1]) > 0.9 ? [0, 0, -back[1]] : [0, 1, 0], back);
    right = unit(right);
    const f = 0.5 * height / Math.tan(fov * Math.PI / 360);
    return {position: eye, axes: [right, cross(back, right), back], orthographic: false, width, height,
            fx: f, fy: f, cx: width / 2, cy: height / 2};
}

// The camera whose pixels are the texels of a rectangle, which shows a part of a view, perhaps turned.
function windowOf(view, r) {
    const c = Object.assign({}, view);
    if (!r.turned) {
        c.cx = view.cx - r.viewX;
        c.cy = view.cy - r.viewY;
        return c;
    }
    c.fx = view.fy;
    c.fy = view.fx;
    c.cx = r.width - (view.cy - r.viewY);
    c.cy = view.cx - r.viewX;
    c.axes = [view.axes[1], times(view.axes[0], -1), view.axes[2]];
    return c;
}

// Where the pixels of a camera are in another's picture: with (u, v) a pixel and z its distance,
// H = (a0 + au u + av v) z + b0 + bu u + bv v, the pixel H.xy / H.z, centres at whole numbers.
function pixelMap(source, novel) {
    const shift = into(novel, minus(source.position, novel.position));
    const cx = novel.cx - 0.5, cy = novel.cy - 0.5;
    const image = (q) => {
        const centre = novel.orthographic ? 0 : -q[2];
        return [novel.fx * q[0] + cx * centre, -novel.fy * q[1] + cy * centre, -q[2]];
    };
    const along = (v) => image(into(novel, outOf(source, v)));
    const offset = plus(image(shift), novel.orthographic ? [cx, cy, 0] : [0, 0, 0]);
    const du = along([1 / source.fx, 0, 0]), dv = along([0, -1 / source.fy, 0]);
    const origin = plus(times(du, 0.5 - source.cx), times(dv, 0.5 - source.cy));
    const axis = along([0, 0, -1]), none = [0, 0, 0];
    if (source.orthographic) return {a0: axis, au: none, av: none, b0: plus(origin, offset), bu: du, bv: dv};
    return {a0: plus(origin, axis), au: du, av: dv, b0: offset, bu: none, bv: none};
}

// The point of pixel (x, y), whose centre is at halves, at a distance.
function pointAt(camera, x, y, dist) {
    const k = camera.orthographic ? 1 : dist;
    return plus(camera.position, outOf(camera, [(x - camera.cx) / camera.fx * k, -(y - camera.cy) / camera.fy * k, -dist]));
}
