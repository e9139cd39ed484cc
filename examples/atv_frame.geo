// The frame of the all-terrain vehicle of atv.cpp: welded steel tubes, one hollow solid, in metres (x forward, y left, z up).
// gmsh -3 -order 2 -o frame.msh examples/atv_frame.geo            -setnumber size 0.02 for a coarser mesh
SetFactory("OpenCASCADE");

If (!Exists(size))
  size = 0.016;
EndIf
outer = 0.016;  // radii of the tubes
inner = 0.012;

// Joints of the left half, mirrored to the right: x, y, z
node() = {
   0.79, 0.14, 0.38,   0.48, 0.14, 0.34,  -0.48, 0.14, 0.34,  -0.79, 0.14, 0.38,   // 0-3: lower rail
   0.79, 0.14, 0.49,   0.48, 0.14, 0.49,  -0.48, 0.14, 0.49,  -0.79, 0.14, 0.49,   // 4-7: rails of the upper arms
   0.79, 0.14, 0.58,   0.48, 0.14, 0.68,   0.10, 0.14, 0.68,  -0.48, 0.14, 0.68,  -0.79, 0.14, 0.62 }; // 8-12: upper rail
head() = {0.376, 0, 0.76}; // of the steering column

// Tubes between joints of one side
tube() = { 0,1, 1,2, 2,3,  4,5, 6,7,  8,9, 9,10, 10,11, 11,12,  0,4, 4,8, 1,5, 5,9, 2,6, 6,11, 3,7, 7,12,  1,10, 2,10 };
across() = {0, 1, 2, 3, 8, 9, 10, 11, 12}; // joints with a tube to the other side
toHead() = {9, 10};

Macro Tube // from (x0, y0, z0) to (x1, y1, z1), a ball at its start
  out() += newv; Cylinder(newv) = {x0, y0, z0, x1 - x0, y1 - y0, z1 - z0, outer};
  in()  += newv; Cylinder(newv) = {x0, y0, z0, x1 - x0, y1 - y0, z1 - z0, inner};
Return

Macro Ball
  out() += newv; Sphere(newv) = {x0, y0, z0, outer};
  in()  += newv; Sphere(newv) = {x0, y0, z0, inner};
Return

out() = {};
in()  = {};
For side In {-1 : 1 : 2}
  For k In {0 : #node() / 3 - 1}
    x0 = node(3 * k); y0 = side * node(3 * k + 1); z0 = node(3 * k + 2);
    Call Ball;
  EndFor
  For k In {0 : #tube() / 2 - 1}
    a = tube(2 * k); b = tube(2 * k + 1);
    x0 = node(3 * a); y0 = side * node(3 * a + 1); z0 = node(3 * a + 2);
    x1 = node(3 * b); y1 = side * node(3 * b + 1); z1 = node(3 * b + 2);
    Call Tube;
  EndFor
  For k In {0 : #toHead() - 1}
    a = toHead(k);
    x0 = node(3 * a); y0 = side * node(3 * a + 1); z0 = node(3 * a + 2);
    x1 = head(0); y1 = head(1); z1 = head(2);
    Call Tube;
  EndFor
EndFor
For k In {0 : #across() - 1}
  a = across(k);
  x0 = node(3 * a); y0 = -node(3 * a + 1); z0 = node(3 * a + 2);
  x1 = x0; y1 = -y0; z1 = z0;
  Call Tube;
EndFor
x0 = head(0); y0 = head(1); z0 = head(2);
Call Ball;

solid() = BooleanUnion{ Volume{out(0)}; Delete; }{ Volume{out({1 : #out() - 1})}; Delete; };
hollow() = BooleanUnion{ Volume{in(0)}; Delete; }{ Volume{in({1 : #in() - 1})}; Delete; };
frame() = BooleanDifference{ Volume{solid()}; Delete; }{ Volume{hollow()}; Delete; };
Physical Volume("steel") = {frame()};

Mesh.MeshSizeMin = size / 3;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeFromCurvature = 0;
Mesh.ElementOrder = 2;
Mesh.SecondOrderLinear = 1;
Mesh.Binary = 1;
