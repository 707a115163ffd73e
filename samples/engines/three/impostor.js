// Loads an atlas of `stx convert --views octahedral:N | hemi-octahedral:N` and `stx pack` as an object of
// three.js. See README.md for the commands.
import * as THREE from "three";
import {fragmentShader, vertexShader} from "./impostor_shader.js";

async function texture(url, colorSpace, filter) {
    const loader = new THREE.ImageBitmapLoader();
    loader.setOptions({premultiplyAlpha: "none", colorSpaceConversion: "none"});
    const result = new THREE.Texture(await loader.loadAsync(url));
    Object.assign(result, {flipY: false, colorSpace, magFilter: filter, minFilter: filter, generateMipmaps: false,
                           needsUpdate: true});
    return result;
}

// An atlas' index and textures, read once for all objects that share them.
const sheets = new Map();

export function loadSheet(folder) {
    if (!sheets.has(folder)) sheets.set(folder, fetch(`${folder}/atlas.json`).then((answer) => answer.json()).then(
        (atlas) => ({atlas, textures: new Map(), texture(t, colorSpace, filter) {
            if (!this.textures.has(t.file)) this.textures.set(t.file, texture(`${folder}/${t.file}`, colorSpace, filter));
            return this.textures.get(t.file);
        }})));
    return sheets.get(folder);
}

// Which axis is up in the pictures of all views together: +Y, unless stx convert was given another --up.
function upOf(ups) {
    const sum = [0, 1, 2].map((k) => ups.reduce((all, up) => all + up[k], 0));
    const axis = sum.map(Math.abs).indexOf(Math.max(...sum.map(Math.abs)));
    return new THREE.Vector3().setComponent(axis, Math.sign(sum[axis]));
}

// The shortest rotation that makes it +Y, as grids are laid out; from -Y, half a turn about X.
function uprightFrom(up) {
    const turn = up.y < -0.5 ? new THREE.Quaternion(1, 0, 0, 0) : new THREE.Quaternion().setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
    return new THREE.Matrix3().setFromMatrix4(new THREE.Matrix4().makeRotationFromQuaternion(turn));
}

// `folder`: the atlas' address; `name`: of an atlas of several objects, the one to draw. Throws what is wrong with it.
export async function loadImpostor(folder, name) {
    const sheet = await loadSheet(folder), {atlas} = sheet;
    const objects = atlas.objects || [{firstView: 0, views: atlas.views.length, bounds: atlas.bounds}];
    const object = objects.find((o) => o.name === name) || (objects.length === 1 && !name && objects[0]);
    if (!object) throw new Error(`${folder} has no object '${name || ""}'; it has ${objects.map((o) => o.name).join(", ")}`);
    const views = atlas.views.slice(object.firstView, object.firstView + object.views);
    const rectangles = atlas.rectangles.filter((r) => views.includes(atlas.views[r.view]));
    const side = Math.round(Math.sqrt(views.length)), {page} = rectangles[0];
    if (side * side !== views.length || side < 3 || rectangles.some((r) => r.page !== page))
        throw new Error(`${folder} has ${views.length} views; a grid of N x N on one page is expected`);
    // stx leaves out views that see nothing, and counts them: view000, view001, ...
    const missing = views.findIndex((v, i) => /^view\d+$/.test(v.name) && Number(v.name.slice(4)) !== i);
    if (missing >= 0)
        throw new Error(`${folder} has no view ${missing}, which sees nothing of the object; all N x N views are needed`);
    const table = new Float32Array(side * side * 20);
    for (const {view, atlasX, atlasY, width, height} of rectangles) {
        const v = atlas.views[view], [x, y, z, w] = v.quaternion;
        if (!v.orthographic || v.depthBits !== 8 || width !== height || width !== v.width)
            throw new Error(`view ${view}: square views with --projection orthographic and --depth-bits 8 are expected`);
        const matrix = new THREE.Matrix4().makeRotationFromQuaternion(new THREE.Quaternion(x, y, z, w)).elements;
        table.set([...matrix.slice(0, 3), v.nearPlane, ...matrix.slice(4, 7), v.farPlane, ...matrix.slice(8, 11), 255,
                   atlasX, atlasY, v.fx, width, ...v.position, 0], (view - object.firstView) * 20);
    }
    const viewTable = new THREE.DataTexture(table, 5, side * side, THREE.RGBAFormat, THREE.FloatType);
    viewTable.needsUpdate = true;
    // The lowest views of a hemi-octahedral grid are at the horizon; of an octahedral one, below.
    const up = upOf(views.map((v, i) => table.slice(i * 20 + 4, i * 20 + 7)));
    const lowest = Math.min(...views.map((v, i) => up.dot(new THREE.Vector3(...table.slice(i * 20 + 8, i * 20 + 11)))));
    const low = new THREE.Vector3(...object.bounds.min), high = new THREE.Vector3(...object.bounds.max);
    const size = high.clone().sub(low);
    // All views look at one point: where the lines of sight of a high and a low one meet.
    const at = (i, k) => new THREE.Vector3(...table.slice(i * 20 + 4 * k, i * 20 + 4 * k + 3));
    const half = side >> 1, top = half * side + half, a = at(top, 4), b = at(half, 4), u = at(top, 2), v = at(half, 2);
    const cosine = u.dot(v), between = b.clone().sub(a);
    const along = (between.dot(u) - cosine * between.dot(v)) / (1 - cosine * cosine);
    const centre = a.addScaledVector(u, along);
    const of = (attribute) => atlas.textures.find((t) => t.attribute === attribute && t.page === page);
    const material = new THREE.ShaderMaterial({
        vertexShader, fragmentShader, side: THREE.BackSide,
        uniforms: {
            colourTexture: {value: await sheet.texture(of("colour"), THREE.SRGBColorSpace, THREE.LinearFilter)},
            depthTexture: {value: await sheet.texture(of("depth"), THREE.NoColorSpace, THREE.NearestFilter)},
            viewTable: {value: viewTable}, side: {value: side}, upright: {value: uprightFrom(up)}, hemi: {value: lowest > -0.1}, centre: {value: centre},
            radius: {value: size.length() / 2}, eye: {value: new THREE.Vector3()}}});
    // What gives off light has it in a texture of its own (stx convert --materials).
    const glow = of("emissive");
    if (glow && glow.coding === "sRGB8-emissive") {
        material.defines = {EMISSIVE: true};
        material.uniforms.emissiveScale = {value: glow.scale};
        material.uniforms.emissiveTexture = {value: await sheet.texture(glow, THREE.SRGBColorSpace, THREE.LinearFilter)};
    }
    const box = new THREE.BoxGeometry(size.x, size.y, size.z).translate(...low.clone().add(high).multiplyScalar(0.5).toArray());
    const mesh = new THREE.Mesh(box, material);
    const inverse = new THREE.Matrix4();
    mesh.onBeforeRender = (renderer, scene, camera) => {
        inverse.copy(mesh.matrixWorld).invert();
        material.uniforms.eye.value.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(inverse);
        material.uniformsNeedUpdate = true;
    };
    return mesh;
}
