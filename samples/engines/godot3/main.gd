# Turns the impostor. `godot3 -- --picture FILE EYE TARGET [OBJECT]` (numbers with commas) draws one picture instead.
extends Spatial

func numbers(text):
	var parts = text.split_floats(",")
	return Vector3(parts[0], parts[1], parts[2])

# Before the impostor is ready.
func _enter_tree():
	var words = Array(OS.get_cmdline_args())
	var at = words.find("--picture")
	if at >= 0 and words.size() > at + 4:
		$Impostor.object = words[at + 4]

func _ready():
	var words = Array(OS.get_cmdline_args())
	var at = words.find("--picture")
	if at < 0:
		return
	set_process(false)
	$Camera.look_at_from_position(numbers(words[at + 2]), numbers(words[at + 3]), Vector3.UP)
	for _frame in range(3):
		yield(get_tree(), "idle_frame")
	var image = get_viewport().get_texture().get_data()
	image.flip_y()
	image.save_png(words[at + 1])
	get_tree().quit()

func _process(delta):
	$Impostor.rotate_y(delta / 4)
