// The merged textures of one moment on the device, and what is known of their points before any camera is.

const kBlock = 16, kTableRows = 1024, kEntry = 8;
const kBlockColumns = 1024;  // of the texture of blocks
const kSmoothDepths = 1.2;  // lib/render/splat/plan.cpp
const kInside = 2, kGlassBorder = 4;  // texels: lib/model/translucent.cpp, lib/render/scene/glass_pages.cpp
const kMostReach = 6;  // pixels that a point covers to each side in another view

// A texture of numbers that shaders read with texelFetch.
function makeTexture(gl, target, internal, format, type, width, height, layers, data) {
    const texture = gl.createTexture();
    gl.bindTexture(target, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    if (target === gl.TEXTURE_2D) gl.texImage2D(target, 0, internal, width, height, 0, format, type, data || null);
    else gl.texImage3D(target, 0, internal, width, height, layers, 0, format, type, data || null);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
    return texture;
}

// How much of each texel glass covers, 1..255: lib/render/scene/glass_pages.cpp. 0 elsewhere; null where nothing is glass.
// Inside of glass texels are in part opaque for kInside texels around; it goes on for kGlassBorder around that.
function glassCoverage(colour, depth) {
    const {width, height} = depth, rgba = colour.values, count = width * height;
    const inPart = (i) => rgba[4 * i + 3] > 0 && rgba[4 * i + 3] < 255;
    const inside = new Uint8Array(count), side = 2 * kInside + 1;
    const down = new Uint16Array(width);  // rows in which this texel has kInside such texels to both sides
    for (let y = 0, i = 0; y < height; ++y) {
        for (let x = 0, run = 0; x < width; ++x, ++i) {
            run = inPart(i) && depth.values[i] !== 0 ? run + 1 : 0;
            const at = x - kInside;
            if (at < 0) continue;
            down[at] = run >= side ? down[at] + 1 : 0;
            if (down[at] >= side) inside[i - kInside - kInside * width] = 1;
        }
    }
    if (!inside.includes(1)) return null;
    const values = new Uint8Array(count);
    for (let y = 0, i = 0; y < height; ++y) {
        for (let x = 0; x < width; ++x, ++i) {
            if (inside[i]) values[i] = 255;
            if (inside[i] || !inPart(i)) continue;
            let most = 0;
            for (let v = Math.max(0, y - kGlassBorder); v <= Math.min(height - 1, y + kGlassBorder); ++v)
                for (let u = Math.max(0, x - kGlassBorder); u <= Math.min(width - 1, x + kGlassBorder); ++u)
                    if (inside[v * width + u]) most = Math.max(most, rgba[4 * (v * width + u) + 3]);
            if (most > 0) values[i] = Math.max(1, Math.round(255 * Math.min(1, rgba[4 * i + 3] / most)));
        }
    }
    return {width, height, channels: 1, values};
}

// Coverage of a view beside what is within two pixels: 0 = all of it is empty, 254 = all is full, 128 = neither is so.
function withSurroundings(alpha, stride, width, height) {
    const count = alpha.length, both = new Uint8Array(2 * count);
    const full = new Uint8Array(count), some = new Uint8Array(count);  // within two pixels along the row
    for (let y = 0; y < height; ++y) {
        for (let x = 2; x + 2 < width; ++x) {
            const i = y * stride + x;
            const a = alpha[i - 2], b = alpha[i - 1], c = alpha[i], d = alpha[i + 1], e = alpha[i + 2];
            full[i] = (a & b & c & d & e) === 255 ? 1 : 0;
            some[i] = (a | b | c | d | e) === 0 ? 0 : 1;
        }
    }
    for (let i = 0; i < count; ++i) both[2 * i] = alpha[i], both[2 * i + 1] = 128;
    for (let y = 2; y + 2 < height; ++y) {
        for (let x = 2; x + 2 < width; ++x) {
            const i = y * stride + x, j = i - 2 * stride, k = i - stride, l = i + stride, m = i + 2 * stride;
            if (full[i] & full[j] & full[k] & full[l] & full[m]) both[2 * i + 1] = 254;
            else if (!(some[i] | some[j] | some[k] | some[l] | some[m])) both[2 * i + 1] = 0;
        }
    }
    return both;
}

// Sets the lowest bit of what is around (withSurroundings()) where a view shows glass or has it beside that, two pixels
// away along either axis or both: nearGlass() of lib/render/outline/silhouettes.cpp.
function markNearGlass(both, glass, stride, width, height) {
    for (let y = 0; y < height; ++y) {
        for (let x = 0; x < width; ++x) {
            if (!glass[y * stride + x]) continue;
            for (const v of [y - 2, y, y + 2])
                for (const u of [x - 2, x, x + 2])
                    if (u >= 0 && v >= 0 && u < width && v < height) both[2 * (v * stride + u) + 1] |= 1;
        }
    }
}

// An image with room to the right and below, so that all textures of a scene are of one size.
function withRoom(image, width, height) {
    if (image.width === width && image.height === height) return image;
    const {channels} = image;
    const values = new image.values.constructor(width * height * channels);
    for (let y = 0; y < image.height; ++y)
        values.set(image.values.subarray(y * image.width * channels, (y + 1) * image.width * channels), y * width * channels);
    return {width, height, channels, values};
}

// Colours with alpha: what has none is opaque.
function withAlpha(image) {
    if (image.channels === 4) return image;
    const values = new Uint8Array(4 * image.width * image.height).fill(255);
    for (let i = 0, n = image.width * image.height; i < n; ++i)
        for (let k = 0; k < 3; ++k) values[4 * i + k] = image.values[3 * i + k];
    return {width: image.width, height: image.height, channels: 4, values};
}

class Scene {
    // `data` is what stx wrote: views, rectangles, and the number of each page's images; `image(number)`
    // gives a decoded one.
    static async load(gl, programs, data, image) {
        const scene = new Scene();
        scene.gl = gl;
        scene.pruned = data.pruned;
        scene.views = data.views.map((v) => Object.assign({axes: axesOf(v.orientation)}, v));
        scene.rectangles = data.rectangles.map(([view, page, viewX, viewY, x, y, width, height, turn]) =>
            ({view, page, viewX, viewY, x, y, width, height, turned: turn === 1}));
        for (const r of scene.rectangles) r.camera = windowOf(scene.views[r.view], r);
        const pages = [], ofViews = [];
        for (const page of data.pages) {
            const decoded = {};
            for (const name of Object.keys(page)) {
                if (name.startsWith("view")) ofViews.push([Number(name.slice(4)), page[name]]);
                else decoded[name] = await image(page[name]);
            }
            const {width, height} = decoded.depth;
            decoded.colour = decoded.colour ? withAlpha(decoded.colour) :
                {width, height, channels: 4, values: new Uint8Array(4 * width * height).fill(255)};
            pages.push(decoded);
        }
        for (const [view, number] of ofViews) scene.paint(pages, view, await image(number), data.padding);
        for (const page of pages) {
            if (page.alpha) page.alpha.values.forEach((a, i) => page.colour.values[4 * i + 3] = a);
            delete page.alpha;
            const glass = glassCoverage(page.colour, page.depth);
            if (glass) page.glass = glass;
        }
        const width = Math.max(...pages.map((p) => p.colour.width)), height = Math.max(...pages.map((p) => p.colour.height));
        for (const page of pages)
            for (const name of Object.keys(page)) page[name] = withRoom(page[name], width, height);
        scene.upload(pages);
        scene.prepare(programs.prepare, pages, data.padding);
        scene.findBlocks(pages);
        scene.findSmooth(programs.smooth);
        scene.makeCover(pages, data.padding);
        return scene;
    }

    // Colours of a view's own picture, with as many texels around its rectangles as stx leaves; beyond the view its edge.
    paint(pages, number, picture, padding) {
        const view = this.views[number], [left, top] = view.colourAt, from = picture.values;
        const inside = (value, size) => Math.max(0, Math.min(size - 1, value));
        for (const r of this.rectangles) {
            if (r.view !== number) continue;
            const {width, height, values} = pages[r.page].colour;
            for (let j = Math.max(-padding, -r.y); j < Math.min(r.height + padding, height - r.y); ++j) {
                for (let i = Math.max(-padding, -r.x); i < Math.min(r.width + padding, width - r.x); ++i) {
                    const x = left + inside(r.viewX + (r.turned ? j : i), view.width);
                    const y = top + inside(r.viewY + (r.turned ? r.width - 1 - i : j), view.height);
                    const to = 4 * ((r.y + j) * width + r.x + i), at = picture.channels * (y * picture.width + x);
                    for (let k = 0; k < 3; ++k) values[to + k] = from[at + k];
                }
            }
        }
    }

    upload(pages) {
        const gl = this.gl, array = gl.TEXTURE_2D_ARRAY;
        this.width = pages[0].colour.width;
        this.height = pages[0].colour.height;
        this.texels = this.width * this.height * pages.length;
        const make = (internal, format, type) =>
            makeTexture(gl, array, internal, format, type, this.width, this.height, pages.length);
        this.colour = make(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE);
        this.depth = make(gl.R16UI, gl.RED_INTEGER, gl.UNSIGNED_SHORT);
        pages.forEach((page, layer) => {
            const put = (texture, format, type, values) => {
                gl.bindTexture(array, texture);
                gl.texSubImage3D(array, 0, 0, 0, layer, this.width, this.height, 1, format, type, values);
            };
            put(this.colour, gl.RGBA, gl.UNSIGNED_BYTE, page.colour.values);
            if (page.depth.values instanceof Uint8Array) page.depth.values = Uint16Array.from(page.depth.values);
            put(this.depth, gl.RED_INTEGER, gl.UNSIGNED_SHORT, page.depth.values);
        });
        this.slope = make(gl.RGBA16I, gl.RGBA_INTEGER, gl.SHORT);
        this.normal = make(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE);
    }

    // Tilts and normals, drawn rectangle by rectangle.
    prepare(program, pages, padding) {
        const gl = this.gl, frame = gl.createFramebuffer();
        const given = ["normal", "splat"].map((name) => {
            if (!pages[0][name]) return makeTexture(gl, gl.TEXTURE_2D, gl.RGB8, gl.RGB, gl.UNSIGNED_BYTE, 1, 1, 1);
            return pages.map((p) => makeTexture(gl, gl.TEXTURE_2D, gl.RGB8, gl.RGB, gl.UNSIGNED_BYTE, this.width,
                                                this.height, 1, p[name].values));
        });
        const glass = pages.map((p) => makeTexture(gl, gl.TEXTURE_2D, gl.R8, gl.RED, gl.UNSIGNED_BYTE, p.glass ? this.width : 1,
                                                   p.glass ? this.height : 1, 1, p.glass && p.glass.values));
        program.use({colourTexture: [this.colour, gl.TEXTURE_2D_ARRAY], depthTexture: [this.depth, gl.TEXTURE_2D_ARRAY],
                     given: [pages[0].normal ? 1 : 0, pages[0].splat ? 1 : 0]});
        gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
        gl.disable(gl.BLEND);
        gl.disable(gl.DEPTH_TEST);
        gl.enable(gl.SCISSOR_TEST);
        gl.viewport(0, 0, this.width, this.height);
        for (const r of this.rectangles) {
            gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.slope, 0, r.page);
            gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, this.normal, 0, r.page);
            gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
            gl.scissor(r.x, r.y, r.width, r.height);
            const view = this.views[r.view], c = r.camera;
            const across = r.turned ? r.height : r.width, down = r.turned ? r.width : r.height;
            const free = [r.viewX, r.viewY, view.width - r.viewX - across, view.height - r.viewY - down];
            const around = (r.turned ? [free[3], free[0], free[1], free[2]] : free).map((n) => Math.min(n, padding, 2));
            const one = (k) => [given[k] instanceof Array ? given[k][r.page] : given[k], gl.TEXTURE_2D];
            program.use({givenNormals: one(0), givenSplats: one(1), glassTexture: [glass[r.page], gl.TEXTURE_2D],
                         hasGlass: Boolean(pages[r.page].glass), area: [r.x, r.y, r.width, r.height], around,
                         sourceLens: [c.fx, c.fy, c.cx, c.cy],
                         planes: [c.nearPlane, c.farPlane, c.dmax, c.orthographic ? 1 : 0],
                         worldFromSource: c.axes.flat(), layer: r.page});
            gl.drawArrays(gl.TRIANGLES, 0, 3);
        }
        gl.disable(gl.SCISSOR_TEST);
        gl.deleteFramebuffer(frame);
        [...given.flat(), ...glass].forEach((t) => gl.deleteTexture(t));
    }

    // Blocks of 16x16 texels that hold points, and points to measure the footprint of a pixel with.
    findBlocks(pages) {
        this.blocks = [];
        this.points = 0;
        this.samples = [];
        const kGrid = 24;
        this.rectangles.forEach((r, number) => {
            const c = r.camera, codes = pages[r.page].depth.values, rgba = pages[r.page].colour.values;
            const distance = (code) => c.nearPlane + (1 - (code - 1) / (c.dmax - 1)) * (c.farPlane - c.nearPlane);
            for (let v0 = 0; v0 < r.height; v0 += kBlock) {
                for (let u0 = 0; u0 < r.width; u0 += kBlock) {
                    const u1 = Math.min(u0 + kBlock, r.width), v1 = Math.min(v0 + kBlock, r.height);
                    let least = 65536, most = 0;
                    for (let v = v0; v < v1; ++v) {
                        let i = (r.y + v) * this.width + r.x + u0;
                        for (let u = u0; u < u1; ++u, ++i) {
                            const code = codes[i];
                            if (code === 0 || rgba[4 * i + 3] === 0) continue;
                            ++this.points;
                            least = Math.min(least, code);
                            most = Math.max(most, code);
                        }
                    }
                    if (most > 0) this.blocks.push({rectangle: number, u0, v0, u1, v1, near: distance(most), far: distance(least)});
                }
            }
            const stepX = Math.max(1, Math.round(this.views[r.view].width / kGrid)), stepY = Math.max(1, Math.round(this.views[r.view].height / kGrid));
            for (let y = stepY >> 1; y < r.height; y += stepY) {
                for (let x = stepX >> 1; x < r.width; x += stepX) {
                    const code = codes[(r.y + y) * this.width + r.x + x];
                    if (code === 0) continue;
                    const dist = distance(code), k = c.orthographic ? 1 : dist;
                    this.samples.push({world: pointAt(c, x + 0.5, y + 0.5, dist), spacing: 0.5 * (k / c.fx + k / c.fy)});
                }
            }
        });
    }

    // Which blocks are smooth, a texel for each.
    findSmooth(program) {
        const gl = this.gl, two = gl.TEXTURE_2D, array = gl.TEXTURE_2D_ARRAY, rows = Math.max(1, Math.ceil(this.blocks.length / kBlockColumns));
        const data = new Float32Array(4 * kBlockColumns * rows);
        this.blocks.forEach((b, n) => {
            const r = this.rectangles[b.rectangle];
            data.set([r.x + b.u0, r.y + b.v0, b.u1 - b.u0 + 32 * (b.v1 - b.v0), 2 * r.page + (b.far < kSmoothDepths * b.near ? 1 : 0)], 4 * n);
        });
        const table = makeTexture(gl, two, gl.RGBA32F, gl.RGBA, gl.FLOAT, kBlockColumns, rows, 1, data), frame = gl.createFramebuffer();
        this.smooth = makeTexture(gl, two, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, kBlockColumns, rows, 1);
        gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, two, this.smooth, 0);
        gl.viewport(0, 0, kBlockColumns, rows);
        program.use({blockTable: [table, two], colourTexture: [this.colour, array], depthTexture: [this.depth, array], slopeTexture: [this.slope, array]});
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.deleteFramebuffer(frame);
        gl.deleteTexture(table);
    }

    // What each view saw of the object's outline: a layer for each, of alpha, or of what glass covers.
    makeCover(pages, padding) {
        const gl = this.gl, views = this.views;
        const width = Math.max(...views.map((v) => v.width)), height = Math.max(...views.map((v) => v.height));
        const most = Math.min(gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS), Math.floor(256e6 / (width * height)));
        // Where nothing is known there is no background either.
        const covers = views.slice(0, most).map((v) =>
            new Uint8Array(width * height).fill(v.noDepth === "unknown" ? 255 : 0));
        const eachTexel = (visit, padding) => this.rectangles.forEach((r) => {
            const view = views[r.view];
            for (let j = -padding; j < r.height + padding; ++j) {
                for (let i = -padding; i < r.width + padding; ++i) {
                    const x = r.viewX + (r.turned ? j : i), y = r.viewY + (r.turned ? r.width - 1 - i : j);
                    if (x >= 0 && y >= 0 && x < view.width && y < view.height) visit(r, x, y, (r.y + j) * this.width + r.x + i);
                }
            }
        });
        const glasses = [];  // by view: 1 where it shows glass
        // Beside a rectangle its padding shows the view.
        const known = covers.map((cover, n) => new Uint8Array(views[n].pruned ? cover.length : 0));
        eachTexel((r, x, y, texel) => {
            if (r.view >= covers.length) return;
            const {colour, glass} = pages[r.page], share = glass ? glass.values[texel] : 0;
            covers[r.view][y * width + x] = share || colour.values[4 * texel + 3];
            if (views[r.view].pruned) known[r.view][y * width + x] = 1;
            if (!share) return;
            glasses[r.view] = glasses[r.view] || new Uint8Array(width * height);
            glasses[r.view][y * width + x] = 1;
        }, Math.min(padding, 2));
        // Pixels that were left out because other views show them are no background: outsideBits() of lib/packing.
        const pruned = [...covers.keys()].filter((n) => views[n].pruned);
        if (pruned.length > 0) {
            eachTexel((r, x, y, texel) => {
                const code = pages[r.page].depth.values[texel], from = views[r.view];
                if (code === 0) return;
                const dist = from.nearPlane + (1 - (code - 1) / (from.dmax - 1)) * (from.farPlane - from.nearPlane);
                const point = pointAt(from, x + 0.5, y + 0.5, dist), spacing = (from.orthographic ? 1 : dist) / from.fx;
                pruned.forEach((n) => {
                    const cover = covers[n], v = views[n], q = into(v, minus(point, v.position)), k = v.orthographic ? 1 : -1 / q[2];
                    if (n === r.view || !(v.orthographic || q[2] < 0)) return;
                    const px = Math.floor(v.cx + v.fx * q[0] * k), py = Math.floor(v.cy - v.fy * q[1] * k);
                    const reach = 1 + Math.floor(Math.min(spacing * v.fx * k, kMostReach - 1));
                    for (let b = Math.max(0, py - reach); b <= Math.min(v.height - 1, py + reach); ++b)
                        for (let a = Math.max(0, px - reach); a <= Math.min(v.width - 1, px + reach); ++a)
                            if (known[n][b * width + a] === 0) cover[b * width + a] = 255;
                });
            }, 0);
        }
        const open = covers.map((cover, n) => {
            const v = views[n];
            for (let y = 0; y < v.height; ++y)
                for (let x = 0; x < v.width; ++x)
                    if (cover[y * width + x] !== 255) return true;
            return false;
        });
        // A view that is full of glass is asked for that alone, and only where there are outlines at all.
        const used = [...covers.keys()].filter((n) => open[n] || (open.includes(true) && glasses[n]));
        this.hasGlass = glasses.length > 0;
        this.covers = used.map((n, layer) => ({view: views[n], layer}));
        const array = gl.TEXTURE_2D_ARRAY;
        this.cover = makeTexture(gl, array, gl.RG8, gl.RG, gl.UNSIGNED_BYTE, width, height, Math.max(1, used.length));
        used.forEach((n, layer) => {
            const {width: across, height: down} = views[n], both = withSurroundings(covers[n], width, across, down);
            if (glasses[n]) markNearGlass(both, glasses[n], width, across, down);
            gl.texSubImage3D(array, 0, 0, 0, layer, width, height, 1, gl.RG, gl.UNSIGNED_BYTE, both);
        });
        gl.texParameteri(array, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
        gl.texParameteri(array, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    }

    // The median of how many samples of the views go into one pixel of a camera, along a side.
    samplesPerPixel(camera) {
        const ratios = [];
        for (const p of this.samples) {
            const q = into(camera, minus(p.world, camera.position)), dist = -q[2];
            const x = camera.cx + camera.fx * q[0] / dist, y = camera.cy + camera.fy * q[1] / dist;
            if (!(dist > 0 && x >= 0 && y >= 0 && x < camera.width && y < camera.height)) continue;
            ratios.push(0.5 * (dist / camera.fx + dist / camera.fy) / p.spacing);
        }
        if (ratios.length === 0) return 1;
        ratios.sort((a, b) => a - b);
        return ratios[ratios.length >> 1];
    }

    release() {
        for (const t of [this.colour, this.depth, this.slope, this.normal, this.smooth, this.cover]) this.gl.deleteTexture(t);
    }
}
