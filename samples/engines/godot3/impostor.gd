# Draws an atlas of `stx convert --views octahedral:N | hemi-octahedral:N` and `stx pack`.
extends MeshInstance

export(String, DIR) var folder = "res://atlas"
export(String) var object = ""  # of an atlas with several objects, the one to draw

func image_of(name):
	var image = Image.new()
	var error = image.load(ProjectSettings.globalize_path(folder.plus_file(name)))
	assert(error == OK)
	return image

func texture_of(image, flags):
	var texture = ImageTexture.new()
	texture.create_from_image(image, flags)
	return texture

func texture_named(atlas, attribute, page, flags):
	for t in atlas.textures:
		if t.attribute == attribute and t.page == page:
			return texture_of(image_of(t.file), flags)

func vector(list):
	return Vector3(list[0], list[1], list[2])

func _ready():
	var file = File.new()
	assert(file.open(folder.plus_file("atlas.json"), File.READ) == OK)
	var atlas = JSON.parse(file.get_as_text()).result
	var one = {"name": "", "firstView": 0, "views": atlas.views.size(), "bounds": atlas.get("bounds")}
	for o in atlas.get("objects", []):
		if o.name == object or (object == "" and atlas.objects.size() == 1):
			one = o
	assert(one.name == object or object == "")
	var side = int(round(sqrt(one.views)))
	assert(side * side == one.views and side > 2)
	# Views that see nothing are left out by stx, and counted: view000, view001, ... All are needed.
	var last = atlas.views[one.firstView + one.views - 1].name
	assert(not last.begins_with("view") or int(last.substr(4)) == one.views - 1)
	# Five texels for each view, see impostor.shader.
	var table = Image.new()
	table.create(5, side * side, false, Image.FORMAT_RGBAF)
	table.lock()
	var ups = Vector3()
	var backs = []
	var page = -1
	for r in atlas.rectangles:
		var row = r.view - one.firstView
		if row < 0 or row >= one.views:
			continue
		assert(page < 0 or page == r.page)
		page = r.page
		var v = atlas.views[r.view]
		assert(v.orthographic and v.depthBits == 8 and r.width == v.width and r.width == r.height)
		var axes = Basis(Quat(v.quaternion[0], v.quaternion[1], v.quaternion[2], v.quaternion[3]))
		var p = v.position
		table.set_pixel(0, row, Color(axes.x.x, axes.x.y, axes.x.z, v.nearPlane))
		table.set_pixel(1, row, Color(axes.y.x, axes.y.y, axes.y.z, v.farPlane))
		table.set_pixel(2, row, Color(axes.z.x, axes.z.y, axes.z.z, 255))
		table.set_pixel(3, row, Color(r.atlasX, r.atlasY, v.fx, r.width))
		table.set_pixel(4, row, Color(p[0], p[1], p[2], 0))
		ups += axes.y
		backs.append(axes.z)
	table.unlock()
	# Which axis is up in the pictures of all views together: +Y, unless stx convert was given another --up.
	var axis = ups.abs().max_axis()
	var up = Vector3()
	up[axis] = sign(ups[axis])
	# The shortest rotation that makes it +Y, as grids are laid out; from -Y, half a turn about X.
	var upright = Basis()
	if axis != Vector3.AXIS_Y:
		upright = Basis(up.cross(Vector3.UP), PI / 2)
	elif up.y < 0:
		upright = Basis(Vector3.RIGHT, PI)
	var lowest = 1.0
	for back in backs:
		lowest = min(lowest, back.dot(up))
	var low = vector(one.bounds.min)
	var high = vector(one.bounds.max)
	# All views look at one point: where the lines of sight of a high and a low one meet.
	var half = side / 2
	var top = atlas.views[one.firstView + half * side + half]
	var rim = atlas.views[one.firstView + half]
	var u = Basis(Quat(top.quaternion[0], top.quaternion[1], top.quaternion[2], top.quaternion[3])).z
	var w = Basis(Quat(rim.quaternion[0], rim.quaternion[1], rim.quaternion[2], rim.quaternion[3])).z
	var between = vector(rim.position) - vector(top.position)
	var along = (between.dot(u) - u.dot(w) * between.dot(w)) / (1 - u.dot(w) * u.dot(w))
	var material = ShaderMaterial.new()
	material.shader = load("res://impostor.shader")
	material.set_shader_param("colour_texture", texture_named(atlas, "colour", page, Texture.FLAG_FILTER))
	material.set_shader_param("depth_texture", texture_named(atlas, "depth", page, 0))
	material.set_shader_param("view_table", texture_of(table, 0))
	material.set_shader_param("side", side)
	material.set_shader_param("hemi", lowest > -0.1)
	material.set_shader_param("upright", upright)
	material.set_shader_param("centre", vector(top.position) + u * along)
	material.set_shader_param("radius", (high - low).length() / 2)
	var box = CubeMesh.new()
	box.size = high - low
	# The mesh is around its own middle.
	material.set_shader_param("box_middle", (low + high) / 2)
	mesh = box
	material_override = material
	extra_cull_margin = (low + high).length() / 2
