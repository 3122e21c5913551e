// L-shaped shielding wall of interlocking lead bricks (chevron edges), laid in stretcher bond. Origin: underside,
// outer corner; legs along +x and +y.
include <lib.scad>
l = 100; h = 50; t = 50; joint = 3; v = 9;
module brick(len) {                                       // along x, V ridge on top and bottom
  translate([joint / 2, 0, 0]) rotate([90, 0, 90]) linear_extrude(len - joint)
    polygon([[0, 1], [0, h - 2], [2, h - joint], [t / 2 - v, h - joint], [t / 2, h + v - joint], [t / 2 + v, h - joint],
             [t - 2, h - joint], [t, h - 2], [t, 1], [t - 2, 0], [t / 2 + v, 0], [t / 2, v], [t / 2 - v, 0], [2, 0]]);
}
module course(n, half) {
  if (half) { brick(l / 2); for (i = [0:n - 2]) translate([l / 2 + l * i, 0, 0]) brick(l); translate([l * (n - 0.5), 0, 0]) brick(l / 2); }
  else for (i = [0:n - 1]) translate([l * i, 0, 0]) brick(l);
}
module wall(n, rows) {
  for (r = [0:rows - 1]) translate([0, 0, h * r]) course(n, r % 2 == 1);
  translate([4, 6, 4]) cube([l * n - 8, t - 12, h * rows - 10]);       // mortarless core: closes the joints
}
wall(4, 5);
translate([t, t + joint, 0]) rotate(90) wall(3, 4);
translate([8, t - 8, 6]) cube([t - 16, 24, h * 4 - 14]);
