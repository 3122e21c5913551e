// Shielding window: stepped, bolted frame with a bevelled glass block. In the plane z = 0, facing +z. Origin: centre.
include <lib.scad>
module step(x, y, z, h, hole) translate([0, 0, z]) linear_extrude(h) difference() { rounded([x, y], 30); rounded(hole, 16); }
step(700, 520, 0, 16, [480, 300]);
step(620, 440, 15, 18, [480, 300]);
step(540, 360, 32, 14, [440, 260]);
translate([0, 0, 2]) hull() { plate([500, 320], 16, 10); plate([470, 290], 16, 36); }
for (i = [-4:4], s = [-1, 1]) translate([70 * i, 240 * s, 15]) bolt(18, 12);
for (j = [-2:2], s = [-1, 1]) translate([328 * s, 80 * j, 15]) bolt(18, 12);
for (s = [-1, 1]) translate([s * 250, 0, 45]) rotate([90, 0, 0]) translate([0, 0, -90]) cylinder(r = 9, h = 180);   // wiper rails
