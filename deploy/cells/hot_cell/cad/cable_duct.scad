// Slotted cable duct on wall brackets, with three cables. Along x, centred; back (wall) at y = 0, towards −y.
include <lib.scad>
l = 1500; w = 90; h = 70;
translate([0, -w / 2, 0]) block(l, w, 5);
for (y = [-w + 3, -3]) translate([-l / 2, y + 2.5, 1]) rotate([90, 0, 0]) linear_extrude(5) difference() {
  square([l, h]);
  for (i = [1:24]) translate([l * i / 25 - 8, 22]) square([16, h]);
}
for (p = [[-25, 22, 13], [-52, 20, 11], [-70, 16, 8]]) translate([-l / 2 - 30, p[0], p[1]]) rotate([0, 90, 0]) cylinder(r = p[2], h = l + 60, $fn = 20);
for (x = [-2, -1, 0, 1, 2]) translate([x * 330, 0, 0]) {
  rotate([90, 0, 90]) translate([0, 0, -6]) linear_extrude(12) polygon([[-1, 2], [-w + 6, 2], [-w + 6, -8], [-12, -70], [-1, -70]]);
  translate([0, -4, -80]) block(44, 10, 120);
  for (z = [-66, -40]) translate([0, -8, z]) { for (s = [-15, 15]) translate([s, 0, 0]) rotate([90, 0, 0]) bolt(10, 6); }
  translate([0, -w / 2, 2]) block(14, w - 8, 12);             // cable tie bridge
}
