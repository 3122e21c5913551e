// Rack with fifteen vials. Origin: underside, centre.
include <lib.scad>
nx = 5; ny = 3; pitch = 42;
plate([nx * pitch + 24, ny * pitch + 10], 8, 10);
translate([0, 0, 62]) linear_extrude(6) difference() {
  rounded([nx * pitch + 24, ny * pitch + 10], 8);
  for (i = [0:nx - 1], j = [0:ny - 1]) translate([(i - (nx - 1) / 2) * pitch, (j - (ny - 1) / 2) * pitch]) circle(16);
}
for (s = [-1, 1]) translate([s * (nx * pitch / 2 + 6), 0, 9]) rotate([90, 0, 90]) translate([0, 0, -5]) linear_extrude(10) difference() {
  translate([0, 60]) rounded([ny * pitch - 6, 122], 10);
  translate([0, 92]) rounded([70, 26], 10);                  // hand hole for the gripper
  translate([0, 26]) rounded([70, 30], 10);
}
module vial(h) rotate_extrude($fn = 20) polygon([[0, 0], [13, 0], [14, 2], [14, h - 24], [9, h - 16], [9, h - 14], [12, h - 13], [12, h], [10, h + 2], [0, h + 2]]);
for (i = [0:nx - 1], j = [0:ny - 1]) translate([(i - (nx - 1) / 2) * pitch, (j - (ny - 1) / 2) * pitch, 8]) vial(98 + 8 * ((i * 7 + j * 3) % 4));
