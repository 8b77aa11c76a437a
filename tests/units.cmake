dlm_unit(scene 1 2)
dlm_unit(fieldsio 1 2 3)
