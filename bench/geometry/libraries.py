"""The peers: the same few calls for each library."""

import numpy as np


class Peer:
    """One way to use a library. What is timed: build() and the functions of `tasks`.

    The constructor makes the caller's arrays of a mesh as the library likes them,
    convert() those of float64 points; neither is timed. `tasks` names functions from
    converted points to whatever the library returns: "closest" and "signed" (which
    distances() reads), "winding" (winding numbers), "inside" (nonzero: inside).
    """

    module = ""  # to import
    builds_always = False  # every call builds its tree

    def __init__(self, vertices, triangles):
        self.V, self.F = vertices, triangles

    def build(self):
        pass

    def convert(self, points):
        return points


class Fcpw(Peer):
    module = "fcpw"
    vectorize = True

    def __init__(self, vertices, triangles):
        import fcpw
        self.fcpw = fcpw
        self.V = np.asfortranarray(vertices, np.float32)
        self.F = np.asfortranarray(triangles, np.int32)

    def build(self):
        self.scene = self.fcpw.scene_3D()
        self.scene.set_object_count(1)
        self.scene.set_object_vertices(self.V, 0)
        self.scene.set_object_triangles(self.F, 0)
        self.scene.build(self.fcpw.aggregate_type.bvh_surface_area, self.vectorize)

    def convert(self, points):
        points = np.ascontiguousarray(points, np.float32)
        # contains() with arrays leaves its result as it was (1.2.0); with lists it works.
        return np.asfortranarray(points), self.fcpw.float_3D_list(list(points))

    def closest(self, points):
        points, _ = points
        hits = self.fcpw.interaction_3D_list()
        self.scene.find_closest_points(points, np.full(len(points), np.inf, np.float32), hits)
        return hits

    def distances(self, hits):
        return np.array([hit.d for hit in hits])

    def contains(self, points):
        result = self.fcpw.uint32_list()
        self.scene.contains(points[1], result)
        return result

    tasks = {"closest": closest, "inside": contains}


class FcpwScalar(Fcpw):
    vectorize = False
    tasks = {"closest": Fcpw.closest}


class Igl(Peer):
    module = "igl"

    def __init__(self, vertices, triangles):
        import igl
        self.igl = igl
        self.V = np.asfortranarray(vertices)
        self.F = np.asfortranarray(triangles, np.int64)

    def convert(self, points):
        return np.asfortranarray(points)


class IglAabb(Igl):
    def build(self):
        self.tree = self.igl.AABB()
        self.tree.init(self.V, self.F)

    def closest(self, points):
        return self.tree.squared_distance(self.V, self.F, points)

    def distances(self, found):
        return np.sqrt(found[0])

    tasks = {"closest": closest}


class IglFastWinding(Igl):
    """Order 2, accuracy 2: the wheel has no others for triangles."""

    builds_always = True

    def winding(self, points):
        return self.igl.fast_winding_number(self.V, self.F, points)

    tasks = {"winding": winding}


class IglSigned(Igl):
    builds_always = True
    kind = "SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER"

    def signed(self, points):
        kind = getattr(self.igl.SignedDistanceType, self.kind)
        return self.igl.signed_distance(points, self.V, self.F, kind)

    def distances(self, found):
        return np.abs(found[0])

    def inside(self, found):
        return found[0] < 0

    tasks = {"signed": signed}


class IglPseudonormal(IglSigned):
    kind = "SIGNED_DISTANCE_TYPE_PSEUDONORMAL"
    tasks = {"signed": IglSigned.signed}


class IglExact(Igl):
    """All solid angles, by the hierarchy of Jacobson et al. 2013: slow and right."""

    builds_always = True

    def winding(self, points):
        return self.igl.winding_number(self.V, self.F, points)

    tasks = {"winding": winding}


class Open3d(Peer):
    module = "open3d"

    def __init__(self, vertices, triangles):
        import open3d
        self.o3d = open3d
        self.V = self.o3d.core.Tensor(np.ascontiguousarray(vertices, np.float32))
        self.F = self.o3d.core.Tensor(np.ascontiguousarray(triangles, np.uint32))

    def build(self):
        self.scene = self.o3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(self.V, self.F)
        # The tree is made at the first query.
        self.scene.compute_distance(self.o3d.core.Tensor(np.zeros((1, 3), np.float32)), nthreads=1)

    def convert(self, points):
        return self.o3d.core.Tensor(np.ascontiguousarray(points, np.float32))

    def closest(self, points):
        # compute_distance would compute the same points, then throw them away.
        return points, self.scene.compute_closest_points(points, nthreads=1)["points"]

    def distances(self, found):
        points, closest = (t.numpy().astype(np.float64) for t in found)
        return np.linalg.norm(points - closest, axis=1)

    def occupancy(self, points):
        return self.scene.compute_occupancy(points, nthreads=1).numpy()

    tasks = {"closest": closest, "inside": occupancy}


PEERS = {"fcpw": Fcpw, "fcpw scalar": FcpwScalar, "libigl AABB": IglAabb,
         "libigl fast winding": IglFastWinding, "libigl signed winding": IglSigned,
         "libigl signed pseudonormal": IglPseudonormal, "libigl exact winding": IglExact,
         "open3d": Open3d}
