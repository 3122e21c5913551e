// Machine vice with a parallel screw, bolted down. Screw along x. Origin: underside, centre.
include <lib.scad>
module jaw(w, h) { rotate([90, 0, 90]) linear_extrude(34) translate([0, h / 2]) offset(6) square([w - 12, h - 12], center = true); }
linear_extrude(18) difference() {
  union() { rounded([250, 110], 14); rounded([120, 170], 18); }
  for (y = [-1, 1]) hull() for (x = [-14, 14]) translate([x, y * 70]) circle(7);
}
translate([0, 0, 17]) linear_extrude(24) difference() {     // slide ways
  translate([10, 0]) rounded([230, 78], 6);
  translate([20, 0]) rounded([150, 26], 6);
}
translate([-108, 0, 17]) jaw(120, 100);                     // fixed jaw
translate([-75, -52, 72]) cube([9, 104, 38]);               // its hardened plate
translate([10, 0, 38]) jaw(112, 80);                        // moving jaw
translate([3, -52, 72]) cube([9, 104, 38]);
translate([43, 0, 38]) block(60, 60, 40);
translate([96, 0, 17]) jaw(76, 62);                         // nut block
translate([40, 0, 58]) rod_x(11, 118);                      // screw
translate([152, 0, 58]) rod_x(17, 24);
translate([164, -75, 58]) rod_y(6, 150);                    // tommy bar with end knobs
for (y = [-75, 75]) translate([164, y, 58]) sphere(11, $fn = 18);
translate([-108 + 17, 0, 117]) for (y = [-35, 35]) translate([0, y, 0]) bolt(16, 7);
