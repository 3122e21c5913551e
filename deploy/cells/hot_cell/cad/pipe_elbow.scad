// From the valve on: flange at x = 0, pipe along +x, long-radius elbow down, pipe into the floor flange at z = −750.
include <lib.scad>
bend = 140; run = 280; drop = 750;
rotate([0, 90, 0]) { flange(100, 24, 8, 80, 20); translate([0, 0, 20]) cylinder(r1 = 62, r2 = 45, h = 34); cylinder(r = 45, h = run + eps, $fn = 40); }
translate([run, 0, -bend]) rotate([90, 0, 0]) rotate_extrude(angle = 90, $fn = 64) translate([bend, 0]) circle(45, $fn = 40);
translate([run + bend, 0, -drop]) {
  cylinder(r = 45, h = drop - bend + eps, $fn = 40);
  flange(110, 22, 8, 88, 20);
  translate([0, 0, 21]) cylinder(r1 = 62, r2 = 45, h = 34);
  translate([0, 0, 330]) { flange(96, 22, 8, 78, 20); translate([0, 0, 23]) mirror([0, 0, 1]) translate([0, 0, -22]) flange(96, 22, 8, 78, 20); }
}
translate([run * 0.55, 0, 40]) { cylinder(r = 16, h = 40); translate([0, 0, 35]) disc(22, 20, 2); translate([0, 0, 50]) cylinder(r = 7, h = 40);
  translate([0, 0, 85]) rotate([0, 0, 30]) { rotate([90, 0, 0]) translate([0, 26, -12]) disc(36, 24, 3); } }   // pressure gauge
