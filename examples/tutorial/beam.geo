// A steel strip of 1 m x 50 mm x 5 mm along x, of bricks with 20 nodes: gmsh -3 -format msh22 -o beam.msh beam.geo
Point(1) = {0, -0.0025, -0.025};
strip[] = Extrude {0, 0.005, 0} { Point{1}; Layers{1}; Recombine; };
face[] = Extrude {0, 0, 0.05} { Line{strip[1]}; Layers{1}; Recombine; };
body[] = Extrude {1, 0, 0} { Surface{face[1]}; Layers{12}; Recombine; };
Physical Volume("steel") = {body[1]};
Physical Surface("left") = {face[1]};
Physical Surface("right") = {body[0]};
Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;
