// Spherical vessel on a column with a bolted manway and a side nozzle. Origin: floor, centre.
include <lib.scad>
r = 150; zc = 640;
rotate_extrude($fn = 56) polygon(concat([[0, 0], [130, 0], [134, 4], [134, 18], [130, 22], [70, 22], [58, 40], [52, 70], [52, 440], [66, 480]],
  [for (a = [-60:6:66]) [r * cos(a), zc + r * sin(a)]], [[60, zc + 150], [92, zc + 152], [94, zc + 156], [94, zc + 188], [90, zc + 192], [34, zc + 192], [26, zc + 204], [0, zc + 204]]));
around(10, 78, 18) translate([0, 0, zc + 191]) bolt(16, 10);
around(6, 104) translate([0, 0, 21]) bolt(22, 14);
rotate_extrude($fn = 56) translate([r, zc]) rounded([16, 26], 3);                     // girth weld band
rotate(200) translate([130, 0, zc + 40]) rotate([0, 80, 0]) { cylinder(r = 24, h = 70); translate([0, 0, 54]) flange(48, 16, 6, 38, 12); }
for (a = [0:120:240]) rotate(a) rotate([90, 0, 0]) translate([0, 0, -6]) linear_extrude(12) polygon([[50, 15], [112, 15], [112, 30], [60, 190], [50, 190]]);
