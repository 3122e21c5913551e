// Wall shelf on two gusset brackets, with a cylindrical container on it. Wall plane x = 0, shelf towards +x, its top at z = 0.
include <lib.scad>
translate([110, 0, -14]) plate([220, 560], 10, 14);
translate([214, 0, -24]) block(10, 540, 34);                 // front lip
module bracket() {
  rotate([90, 0, 0]) linear_extrude(10) difference() {
    offset(4) offset(-4) polygon([[0, 0], [205, 0], [205, -26], [40, -190], [0, -190]]);
    translate([52, -52]) circle(24); translate([110, -42]) circle(15); translate([38, -118]) circle(16);
  }
  translate([0, -30, -200]) cube([9, 50, 200]);
  for (z = [-30, -170]) translate([8, -18, z]) rotate([0, 90, 0]) bolt(16, 8);
  for (z = [-30, -170]) translate([8, 8, z]) rotate([0, 90, 0]) bolt(16, 8);
}
for (y = [-190, 200]) translate([1, y, -13]) bracket();
translate([115, 90, -1]) rotate_extrude($fn = 44) polygon([[0, 0], [62, 0], [66, 4], [66, 120], [70, 124], [70, 140], [64, 146], [24, 146], [20, 158], [0, 158]]);
translate([110, -120, -1]) { plate([130, 180], 14, 60); translate([0, 0, 59]) plate([138, 188], 16, 10); translate([0, 0, 68]) { for (y = [-40, 40]) translate([0, y, 0]) cylinder(r = 6, h = 24); translate([0, -46, 22]) rod_y(7, 92); } }
