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

// `folder`: the atlas' address. Throws what is wrong with it.
export async function loadImpostor(folder) {
    const atlas = await (await fetch(`${folder}/atlas.json`)).json();
    const side = Math.round(Math.sqrt(atlas.views.length));
    if (side * side !== atlas.views.length || side < 3 || atlas.pages !== 1)
        throw new Error(`${folder} has ${atlas.views.length} views on ${atlas.pages} pages; a grid of N x N on one is expected`);
    const table = new Float32Array(side * side * 20);
    for (const {view, atlasX, atlasY, width, height} of atlas.rectangles) {
        const v = atlas.views[view], [x, y, z, w] = v.quaternion;
        if (!v.orthographic || v.depthBits !== 8 || width !== height || width !== v.width)
            throw new Error(`view ${view}: square views with --projection orthographic and --depth-bits 8 are expected`);
        const matrix = new THREE.Matrix4().makeRotationFromQuaternion(new THREE.Quaternion(x, y, z, w)).elements;
        table.set([...matrix.slice(0, 3), v.nearPlane, ...matrix.slice(4, 7), v.farPlane, ...matrix.slice(8, 11), 255,
                   atlasX, atlasY, v.fx, width, ...v.position, 0], view * 20);
    }
    const viewTable = new THREE.DataTexture(table, 5, side * side, THREE.RGBAFormat, THREE.FloatType);
    viewTable.needsUpdate = true;
    // The lowest views of a hemi-octahedral grid are at the horizon; of an octahedral one, below.
    const up = new THREE.Vector3(0, 1, 0);
    const lowest = Math.min(...atlas.views.map((v, i) => up.dot(new THREE.Vector3(...table.slice(i * 20 + 8, i * 20 + 11)))));
    const low = new THREE.Vector3(...atlas.bounds.min), high = new THREE.Vector3(...atlas.bounds.max);
    const size = high.clone().sub(low);
    // All views look at one point: where the lines of sight of a high and a low one meet.
    const at = (i, k) => new THREE.Vector3(...table.slice(i * 20 + 4 * k, i * 20 + 4 * k + 3));
    const half = side >> 1, top = half * side + half, a = at(top, 4), b = at(half, 4), u = at(top, 2), v = at(half, 2);
    const cosine = u.dot(v), between = b.clone().sub(a);
    const along = (between.dot(u) - cosine * between.dot(v)) / (1 - cosine * cosine);
    const centre = a.addScaledVector(u, along);
    const material = new THREE.ShaderMaterial({
        vertexShader, fragmentShader, side: THREE.BackSide,
        uniforms: {
            colourTexture: {value: await texture(`${folder}/colour.png`, THREE.SRGBColorSpace, THREE.LinearFilter)},
            depthTexture: {value: await texture(`${folder}/depth.png`, THREE.NoColorSpace, THREE.NearestFilter)},
            viewTable: {value: viewTable}, side: {value: side}, hemi: {value: lowest > -0.1}, centre: {value: centre},
            radius: {value: size.length() / 2}, eye: {value: new THREE.Vector3()}}});
    // What gives off light has it in a texture of its own (stx convert --materials).
    const glow = atlas.textures.find((t) => t.attribute === "emissive" && t.coding === "sRGB8-emissive");
    if (glow) {
        material.defines = {EMISSIVE: true};
        material.uniforms.emissiveScale = {value: glow.scale};
        material.uniforms.emissiveTexture =
            {value: await texture(`${folder}/${glow.file}`, THREE.SRGBColorSpace, THREE.LinearFilter)};
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
