"""Writers of the scenes of tests/sweep/meshes, each a function of scene and folder that gives the file's path, or None
where the format cannot say what the scene holds."""
import json
import os
import struct

import numpy as np

# 0 or 1, which is the same as light and as sRGB.
COLOURS = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)]


def listed(values):
    return " ".join(f"{float(v):.17g}" for v in np.ravel(values))


def put(folder, name, text):
    path = os.path.join(folder, name)
    with open(path, "wb" if isinstance(text, bytes) else "w") as out:
        out.write(text)
    return path


def gltf(scene, folder):
    data, views, accessors, meshes, nodes = b"", [], [], [], []

    def accessor(values, code, kind, size):
        nonlocal data
        packed = struct.pack(f"<{len(values) * size}{code}", *np.ravel(values))
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126 if code == "f" else 5125, "count": len(values), "type": kind})
        if kind == "VEC3":
            accessors[-1].update(min=list(map(float, np.float32(values).min(0))), max=list(map(float, np.float32(values).max(0))))
        data += packed + bytes(-len(packed) % 4)
        return len(accessors) - 1

    # Coordinates of each texture, transformed by the file or in it.
    shifts = [scene.dice.choice([None, (0.25, 0.5, 2.0, 0.5)]) for _ in scene.materials]
    for node in scene.nodes:
        entry = {"name": node.name, "children": [i for i, n in enumerate(scene.nodes) if n.parent is node]}
        if not entry["children"]:
            del entry["children"]
        if scene.dice.random() < 0.5:
            entry["matrix"] = [float(v) for v in node.own.T.ravel()]
        else:
            entry.update(translation=node.move, rotation=quaternion(node.rotation), scale=node.scale)
        if node.mesh:
            entry["mesh"] = scene.meshes.index(node.mesh)
        nodes.append(entry)
    for mesh in scene.meshes:
        primitives = []
        for p in mesh:
            uvs = np.array([(u, 1 - v) for u, v in p.uvs])
            if shifts[p.material]:
                ox, oy, sx, sy = shifts[p.material]
                uvs = (uvs - (ox, oy)) / (sx, sy)
            primitives.append({"material": p.material, "indices": accessor(p.triangles, "I", "SCALAR", 3), "attributes": {
                "POSITION": accessor(p.corners, "f", "VEC3", 3), "TEXCOORD_0": accessor(uvs, "f", "VEC2", 2)}})
            accessors[primitives[-1]["indices"]]["count"] *= 3
        meshes.append({"primitives": primitives})
    materials = []
    for material, shift in zip(scene.materials, shifts):
        pbr = {"baseColorFactor": [*material["colour"], 1]}
        if material["texture"] >= 0:
            pbr["baseColorTexture"] = {"index": material["texture"]}
            if shift:
                pbr["baseColorTexture"]["extensions"] = {"KHR_texture_transform": {"offset": shift[:2], "scale": shift[2:]}}
        materials.append({"pbrMetallicRoughness": pbr, "doubleSided": True})
    clamps = {m["texture"]: m["clamps"] for m in scene.materials if m["texture"] >= 0}
    count = len(scene.textures)
    root = {"asset": {"version": "2.0"}, "scene": 0, "nodes": nodes, "meshes": meshes, "materials": materials,
            "scenes": [{"nodes": [i for i, n in enumerate(scene.nodes) if n.parent is None]}],
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data), "uri": "scene.bin"}]}
    if count:
        root.update(extensionsUsed=["KHR_texture_transform"], images=[{"uri": f"texture{k}.png"} for k in range(count)],
                    samplers=[{"wrapS": w, "wrapT": w} for w in (10497, 33071)],
                    textures=[{"source": k, "sampler": int(clamps[k])} for k in range(count)])
    put(folder, "scene.bin", data)
    return put(folder, "scene.gltf", json.dumps(root))


def quaternion(m):
    """x, y, z, w of a rotation."""
    values, vectors = np.linalg.eigh(np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m.trace()]]))
    return [float(v) for v in vectors[:, values.argmax()]]


def obj(scene, folder):
    lines, points = ["mtllib scene.mtl"], 0
    for polygon, world in scene.parts:
        lines += [f"v {listed(p)}" for p in world] + [f"vt {listed(uv)}" for uv in polygon.uvs]
        count = len(world)
        first = -count if scene.dice.random() < 0.5 else points + 1
        lines += [f"usemtl m{polygon.material}", "f " + " ".join(f"{first + i}/{first + i}" for i in range(count))]
        points += count
    mtl = []
    for k, m in enumerate(scene.materials):
        mtl += [f"newmtl m{k}", f"Kd {listed(m['colour'])}"]
        if m["texture"] >= 0:
            mtl.append(f"map_Kd {'-clamp on ' if m['clamps'] else ''}texture{m['texture']}.png")
    put(folder, "scene.mtl", "\n".join(mtl) + "\n")
    return put(folder, "scene.obj", "\n".join(lines) + "\n")


# What stx takes Z_UP of COLLADA and an up of +Z of FBX to: (x, y, z) becomes (x, z, -y).
FROM_Y_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])


def collada(scene, folder):
    def source(name, values, params):
        return (f'<source id="{name}"><float_array id="{name}-a" count="{np.size(values)}">{listed(values)}</float_array><technique_common>'
                f'<accessor source="#{name}-a" count="{len(values)}" stride="{len(params)}">'
                + "".join(f'<param name="{p}" type="float"/>' for p in params) + "</accessor></technique_common></source>")

    if any(m.get("clamps") for m in scene.materials):
        return None
    geometries = []
    for number, mesh in enumerate(scene.meshes):
        name = f"g{number}"
        corners = [c for p in mesh for c in p.corners]
        uvs = [uv for p in mesh for uv in p.uvs]
        lists, first = "", 0
        for p in mesh:
            count = len(p.corners)
            lists += (f'<polylist material="s{p.material}" count="1"><input semantic="VERTEX" source="#{name}-v" offset="0"/>'
                      f'<input semantic="TEXCOORD" source="#{name}-t" offset="0" set="0"/><vcount>{count}</vcount>'
                      f"<p>{' '.join(str(first + i) for i in range(count))}</p></polylist>")
            first += count
        geometries.append(f'<geometry id="{name}"><mesh>{source(name + "-p", corners, "XYZ")}{source(name + "-t", uvs, "ST")}'
                          f'<vertices id="{name}-v"><input semantic="POSITION" source="#{name}-p"/></vertices>{lists}</mesh></geometry>')

    def placed(node):
        if scene.dice.random() < 0.5:
            own = f"<matrix>{listed(node.own)}</matrix>"
        else:
            own = f"<translate>{listed(node.move)}</translate>" + "".join(
                f"<rotate>{axis} {angle:.17g}</rotate>" for axis, angle in zip(("0 0 1", "0 1 0", "1 0 0"), node.turn[::-1])
            ) + f"<scale>{listed(node.scale)}</scale>"
        shown = ""
        if node.mesh:
            used = sorted({p.material for p in node.mesh})
            bound = "".join(f'<instance_material symbol="s{m}" target="#m{m}"><bind_vertex_input semantic="UV" input_semantic="TEXCOORD" '
                            'input_set="0"/></instance_material>' for m in used)
            shown = (f'<instance_geometry url="#g{scene.meshes.index(node.mesh)}"><bind_material><technique_common>{bound}</technique_common>'
                     "</bind_material></instance_geometry>")
        return f'<node id="n{scene.nodes.index(node)}" name="{node.name}">{own}{shown}{"".join(placed(n) for n in scene.nodes if n.parent is node)}</node>'

    effects, materials = "", ""
    for k, m in enumerate(scene.materials):
        params, diffuse = "", f"<color>{listed(m['colour'])} 1</color>"
        if m["texture"] >= 0:
            params = (f'<newparam sid="f{k}"><surface type="2D"><init_from>i{m["texture"]}</init_from></surface></newparam>'
                      f'<newparam sid="t{k}"><sampler2D><source>f{k}</source></sampler2D></newparam>')
            diffuse = f'<texture texture="t{k}" texcoord="UV"/>'
        effects += (f'<effect id="e{k}"><profile_COMMON>{params}<technique sid="c"><lambert><diffuse>{diffuse}</diffuse></lambert>'
                    "</technique></profile_COMMON></effect>")
        materials += f'<material id="m{k}"><instance_effect url="#e{k}"/></material>'
    up, metre = scene.dice.choice(("Y_UP", "Z_UP")), scene.dice.choice((1, 0.01))
    root = np.diag([1 / metre] * 3 + [1]) @ (FROM_Y_UP if up == "Z_UP" else np.eye(4))
    images = "".join(f'<image id="i{k}"><init_from>texture{k}.png</init_from></image>' for k in range(len(scene.textures)))
    return put(folder, "scene.dae", (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>'
        f'<unit name="u" meter="{metre}"/><up_axis>{up}</up_axis></asset><library_images>{images}</library_images>'
        f"<library_effects>{effects}</library_effects><library_materials>{materials}</library_materials><library_geometries>"
        f'{"".join(geometries)}</library_geometries><library_visual_scenes><visual_scene id="s"><node id="root"><matrix>{listed(root)}'
        f'</matrix>{"".join(placed(n) for n in scene.nodes if n.parent is None)}</node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'))


def fbx(scene, folder):
    objects, connections = [], []
    # Coordinates of each texture, moved by the file or in it.
    shifts = [scene.dice.choice([(0, 0), (0.25, -0.5)]) for _ in scene.materials]

    def block(head, *lines):
        return head + " {\n" + "".join(f"\t{line}\n" for text in lines for line in text.split("\n")) + "}"

    def array(name, values):
        return block(f"{name}: *{np.size(values)}", "a: " + ",".join(f"{v:.17g}" if isinstance(v, float) else str(v) for v in np.ravel(values).tolist()))

    def layer(kind, number, mapping, *arrays):
        return block(f"LayerElement{kind}: {number}", "Version: 101", 'Name: ""', f'MappingInformationType: "{mapping}"',
                     f'ReferenceInformationType: "{"Direct" if kind == "UV" else "IndexToDirect"}"', *arrays)

    def model(number, name, kind, move, turn, scale):
        values = [f'P: "Lcl {what}", "Lcl {what}", "", "A",{",".join(f"{v:.17g}" for v in value)}'
                  for what, value in (("Translation", move), ("Rotation", turn), ("Scaling", scale))]
        return block(f'Model: {number}, "Model::{name}", "{kind}"', "Version: 232", block("Properties70: ", *values), "Shading: Y",
                     'Culling: "CullingOff"')

    up, unit = scene.dice.choice(("Y", "Z")), scene.dice.choice((100.0, 1.0))
    objects.append(model(1, "root", "Null", (0, 0, 0), (90 if up == "Z" else 0, 0, 0), [100 / unit] * 3))
    connections.append((1, 0))
    for i, node in enumerate(scene.nodes):
        own = 100 + i
        objects.append(model(own, node.name, "Mesh" if node.mesh else "Null", node.move, node.turn, node.scale))
        connections.append((own, 100 + scene.nodes.index(node.parent) if node.parent else 1))
        if node.mesh:
            connections += [(300 + m, own) for m in sorted({p.material for p in node.mesh})]
            connections.append((200 + scene.meshes.index(node.mesh), own))
    for i, mesh in enumerate(scene.meshes):
        used = sorted({p.material for p in mesh})
        corners, first = [], 0
        for p in mesh:
            corners += [*range(first, first + len(p.corners) - 1), -(first + len(p.corners))]
            first += len(p.corners)
        objects.append(block(
            f'Geometry: {200 + i}, "Geometry::part", "Mesh"', array("Vertices", [c for p in mesh for c in p.corners]),
            array("PolygonVertexIndex", corners), "GeometryVersion: 124",
            layer("UV", 0, "ByPolygonVertex", array("UV", [float(v - s) for p in mesh for uv in p.uvs for v, s in zip(uv, shifts[p.material])])),
            layer("Material", 0, "ByPolygon", array("Materials", [used.index(p.material) for p in mesh])),
            block("Layer: 0", "Version: 100", *(block("LayerElement: ", f'Type: "LayerElement{kind}"', "TypedIndex: 0")
                                                for kind in ("Material", "UV")))))
    for k, m in enumerate(scene.materials):
        objects.append(block(f'Material: {300 + k}, "Material::m{k}", ""', "Version: 102", 'ShadingModel: "lambert"', "MultiLayer: 0", block(
            "Properties70: ", 'P: "DiffuseColor", "Color", "", "A",' + ",".join(map(str, m["colour"])))))
        if m["texture"] >= 0:
            file = f"texture{m['texture']}.png"
            (x, y), clamps = shifts[k], int(m["clamps"])
            objects.append(block(f'Texture: {400 + k}, "Texture::t{k}", ""', 'Type: "TextureVideoClip"', "Version: 202", block(
                "Properties70: ", f'P: "Translation", "Vector", "", "A",{x},{y},0', f'P: "WrapModeU", "enum", "", "",{clamps}',
                f'P: "WrapModeV", "enum", "", "",{clamps}'),
                                 f'FileName: "{file}"', f'RelativeFilename: "{file}"'))
            connections.append((400 + k, 300 + k, "DiffuseColor"))
    axes = {"Y": (1, 1, 2, 1, 0, 1), "Z": (2, 1, 1, -1, 0, 1)}[up]
    names = ("UpAxis", "UpAxisSign", "FrontAxis", "FrontAxisSign", "CoordAxis", "CoordAxisSign")
    settings = [f'P: "{name}", "int", "Integer", "",{value}' for name, value in zip(names, axes)]
    settings.append(f'P: "UnitScaleFactor", "double", "Number", "",{unit}')
    lines = [f'C: "{"OP" if more else "OO"}",{a},{b}' + "".join(f', "{name}"' for name in more) for a, b, *more in connections]
    return put(folder, "scene.fbx", "\n".join([
        "; FBX 7.4.0 project file", block("FBXHeaderExtension: ", "FBXHeaderVersion: 1003", "FBXVersion: 7400"),
        block("GlobalSettings: ", "Version: 1000", block("Properties70: ", *settings)), block("Definitions: ", "Version: 100"),
        block("Objects: ", *objects), block("Connections: ", *lines)]) + "\n")


def ply(scene, folder):
    if scene.textures:
        return None
    binary = scene.dice.random() < 0.5
    points = [(p, scene.materials[polygon.material]["colour"]) for polygon, world in scene.parts for p in world]
    head = ("ply\nformat " + ("binary_little_endian" if binary else "ascii") + f" 1.0\nelement vertex {len(points)}\n"
            + "".join(f"property double {c}\n" for c in "xyz") + "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
            + f"element face {len(scene.parts)}\nproperty list uchar int vertex_indices\nend_header\n")
    body, first = [head.encode()], 0
    for p, colour in points:
        rgb = [255 * c for c in colour]
        body.append(struct.pack("<3d3B", *p, *rgb) if binary else f"{listed(p)} {' '.join(map(str, rgb))}\n".encode())
    for _, world in scene.parts:
        corners = range(first, first + len(world))
        body.append(struct.pack(f"<B{len(world)}i", len(world), *corners) if binary
                    else f"{len(world)} {' '.join(map(str, corners))}\n".encode())
        first += len(world)
    return put(folder, "scene.ply", b"".join(body))


def stl(scene, folder):
    triangles = [[world[i] for i in t] for polygon, world in scene.parts for t in polygon.triangles]
    if scene.dice.random() < 0.5:
        return put(folder, "scene.stl", bytes(80) + struct.pack("<I", len(triangles)) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *np.ravel(t), 0) for t in triangles))
    facets = "".join("facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {listed(p)}\n" for p in t) + "endloop\nendfacet\n"
                     for t in triangles)
    return put(folder, "scene.stl", f"solid scene\n{facets}endsolid scene\n")


def off(scene, folder):
    points = [p for _, world in scene.parts for p in world]
    lines, first = ["OFF", f"{len(points)} {len(scene.parts)} 0"] + [listed(p) for p in points], 0
    for _, world in scene.parts:
        lines.append(f"{len(world)} {' '.join(str(first + i) for i in range(len(world)))}")
        first += len(world)
    return put(folder, "scene.off", "\n".join(lines) + "\n")


# Of each format: its writer, and what of a scene it shows.
WRITERS = {"gltf": (gltf, "colours"), "obj": (obj, "colours"), "dae": (collada, "colours"), "fbx": (fbx, "colours"), "ply": (ply, "colours"),
           "stl": (stl, "shape"), "off": (off, "shape")}
