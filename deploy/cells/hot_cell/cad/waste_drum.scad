// Waste drum with rolling ribs, lid, clamping ring and bungs. Origin: floor, centre.
include <lib.scad>
r = 190; h = 560;
function rib(z) = [[r, z - 16], [r + 9, z - 7], [r + 9, z + 7], [r, z + 16]];
rotate_extrude($fn = 64) polygon(concat(
  [[0, 12], [r - 12, 12], [r - 12, 0], [r - 3, 0], [r, 4]], rib(60), rib(200), rib(350), rib(480),
  [[r, h - 26], [r + 12, h - 22], [r + 12, h - 2], [r + 6, h + 4], [r - 8, h + 4], [r - 14, h - 8], [r - 60, h - 8],
   [r - 68, h - 3], [0, h - 3]]));
translate([100, 0, h - 9]) disc(32, 16, 3);
translate([-95, 40, h - 9]) disc(20, 14, 3);
translate([r + 4, -24, h - 22]) cube([26, 48, 16]);         // clamping ring's lock
translate([r + 20, 0, h - 60]) rotate([0, 8, 0]) plate([12, 18], 4, 60);
for (a = [60, 240]) rotate(a) translate([r - 6, 0, 400]) rotate([90, 0, 0]) rotate_extrude($fn = 24) translate([28, 0]) circle(6, $fn = 10);
