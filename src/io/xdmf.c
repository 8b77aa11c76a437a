/*
  The XDMF file: the light XML that tells ParaView what the arrays of the outputs mean.

  One temporal collection; each output is a spatial collection of the meshes that have a field and of the sets of points. XDMF lists axes slowest first, so
  sizes, origin and spacing stand in the order x3, x2, x1.

  A symmetric tensor is a Matrix of six columns: of a Tensor6 one of VTK's two readers makes nine components, the other leaves six in XDMF's order, which
  ParaView then names as if they were in its own.
*/
#include "../../include/private/dlmfieldsio.h"

_Static_assert(sizeof(PetscReal) == 8, "fields.xmf says 8-byte numbers");
#define H5_FLOAT "NumberType=\"Float\" Precision=\"8\" Format=\"HDF\""
#define H5_INTEGER "NumberType=\"Int\" Precision=\"4\" Format=\"HDF\""
#define IN_FILE "fields.h5:/" DLM_STEP_NAME

static const char *AttributeType(PetscInt dof)
{
  return dof <= 1 ? "Scalar" : dof == 3 ? "Vector" : "Matrix";
}

static void WriteGrid(FILE *out, DLMFieldFile file, PetscInt mesh_index)
{
  const DLMFieldMesh *mesh = &file->meshes[mesh_index];
  int                 n[3];

  for (int i = 0; i < 3; i++) n[i] = (int)(mesh->nodes[i] + mesh->periodic[i]);
  fprintf(out, "        <Grid Name=\"%s\">\n", mesh->name);
  fprintf(out, "          <Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"%d %d %d\"/>\n", n[2], n[1], n[0]);
  fprintf(out, "          <Geometry GeometryType=\"ORIGIN_DXDYDZ\">\n");
  for (int i = 0; i < 2; i++) {
    const PetscReal *a = i ? mesh->spacing : mesh->origin;
    fprintf(out, "            <DataItem Name=\"%s\" Dimensions=\"3\" NumberType=\"Float\" Precision=\"8\" Format=\"XML\">", i ? "Spacing" : "Origin");
    fprintf(out, "%.17g %.17g %.17g</DataItem>\n", (double)a[2], (double)a[1], (double)a[0]);
  }
  fprintf(out, "          </Geometry>\n");
  for (const DLMFieldEntry *field = file->fields; field < file->fields + file->n_fields; field++) {
    if (field->mesh != mesh_index) continue;
    fprintf(out, "          <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">\n", field->name, AttributeType(field->dof));
    fprintf(out, "            <DataItem Dimensions=\"%d %d %d", n[2], n[1], n[0]);
    if (field->dof > 1) fprintf(out, " %d", (int)field->dof);
    fprintf(out, "\" " H5_FLOAT ">" IN_FILE "/%s</DataItem>\n", file->step, field->name);
    fprintf(out, "          </Attribute>\n");
  }
  fprintf(out, "        </Grid>\n");
}

/* An array of a set: one int (dof 0), or reals, for each of its points. */
static void WritePointItem(FILE *out, DLMFieldFile file, const DLMFieldPoints *set, const char *name, PetscInt dof)
{
  fprintf(out, "            <DataItem Dimensions=\"%d%s\" %s>", (int)set->n, dof == 3 ? " 3" : "", dof ? H5_FLOAT : H5_INTEGER);
  fprintf(out, IN_FILE "/%s/%s</DataItem>\n", file->step, set->name, name);
}

static void WritePointAttribute(FILE *out, DLMFieldFile file, const DLMFieldPoints *set, const char *name, PetscInt dof)
{
  fprintf(out, "          <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">\n", name, AttributeType(dof));
  WritePointItem(out, file, set, name, dof);
  fprintf(out, "          </Attribute>\n");
}

/* Points with their ids as connectivity: ParaView's XDMF 3 reader does not count for itself. */
static void WritePoints(FILE *out, DLMFieldFile file, const DLMFieldPoints *set)
{
  fprintf(out, "        <Grid Name=\"%s\">\n", set->name);
  fprintf(out, "          <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%d\" NodesPerElement=\"1\">\n", (int)set->n);
  WritePointItem(out, file, set, "id", 0);
  fprintf(out, "          </Topology>\n");
  fprintf(out, "          <Geometry GeometryType=\"XYZ\">\n");
  WritePointItem(out, file, set, set->array[0].name, 3);
  fprintf(out, "          </Geometry>\n");
  WritePointAttribute(out, file, set, "id", 0);
  for (PetscInt k = 1; k < set->n_arrays; k++) WritePointAttribute(out, file, set, set->array[k].name, set->array[k].dof);
  fprintf(out, "        </Grid>\n");
}

char *DLMFieldFileXdmfOfStep(DLMFieldFile file)
{
  char  *text = NULL;
  size_t size;
  FILE  *out = open_memstream(&text, &size);

  if (!out) return NULL;
  fprintf(out, "      <Grid Name=\"" DLM_STEP_NAME "\" GridType=\"Collection\" CollectionType=\"Spatial\">\n", file->step);
  fprintf(out, "        <Time Value=\"%.17g\"/>\n", (double)file->time);
  for (PetscInt m = 0; m < file->n_meshes; m++) {
    PetscBool used = PETSC_FALSE;
    for (PetscInt f = 0; f < file->n_fields; f++) used |= file->fields[f].mesh == m;
    if (used) WriteGrid(out, file, m);
  }
  for (PetscInt k = 0; k < file->n_sets; k++) WritePoints(out, file, &file->sets[k]);
  fprintf(out, "      </Grid>\n");
  if (!fclose(out)) return text;
  free(text);
  return NULL;
}

void DLMFieldFileWriteXdmf(DLMFieldFile file, FILE *out)
{
  fprintf(out, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n");
  fprintf(out, "    <Grid Name=\"dlmfd\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (PetscInt s = 0; s < file->n_steps; s++) fputs(file->steps[s].xdmf, out);
  fprintf(out, "    </Grid>\n  </Domain>\n</Xdmf>\n");
}
