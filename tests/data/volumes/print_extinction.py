"""Prints the extinction of the media of filters.xml at four points, by Mitsuba 3.9.1."""
import mitsuba as mi

mi.set_variant("scalar_rgb")
shapes = {shape.id(): shape for shape in mi.load_file("filters.xml").shapes()}
for name in ["clamp", "repeat", "mirror"]:
    medium = shapes[name].interior_medium()
    values = []
    for point in [[0.9, 0.3, 0.2], [0.6, 0.75, 0.7], [1.35, 0.95, 0.8], [0.55, 0.1, -0.45]]:
        at = mi.MediumInteraction3f()
        at.p = point
        values.append(medium.get_scattering_coefficients(at)[2][0])
    print(name, values)
